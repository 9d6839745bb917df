#pragma once

#include <memory>

#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"

namespace demslam {

/// Turns calibrated pairs into ideal ones (Fusiello et al. 2000: both cameras turn about their centres until their x
/// axes lie on the baseline). Computed once per rig. The rectified images have the size of the raw ones and show no
/// pixel that the raw ones lack; rays more than 70 degrees off the axis are cut.
///
/// What is already ideal stays as it is, byte for byte: both images where the calibration is ideal, the left one alone
/// where the right one is only shifted against it (a constant row offset; the rows it lacks repeat its border).
class Rectifier {
 public:
  /// Throws Error when the cameras stand the wrong way round, or see too little in common to be rectified.
  explicit Rectifier(const StereoRig& rig);
  ~Rectifier();
  Rectifier(Rectifier&&) noexcept;

  const RectifiedRig& rig() const;
  bool is_identity() const;
  /// Images must have the rig's size (precondition; the dataset readers check it).
  Image left(const Image& raw) const;
  Image right(const Image& raw) const;

 private:
  struct Maps;
  std::unique_ptr<Maps> maps_;
};

}  // namespace demslam

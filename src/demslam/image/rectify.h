#pragma once

#include <memory>

#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"

namespace demslam {

/// Turns calibrated pairs into ideal ones (Fusiello-type rectification as in OpenCV stereoRectify). Computed once per rig.
/// A pair whose calibration is already ideal passes through untouched, byte for byte.
class Rectifier {
 public:
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

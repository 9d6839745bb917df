#pragma once

#include "demslam/sim/ground_layer.h"
#include "demslam/sim/route.h"

namespace demslam {

/// The ruts that the wheels have pressed along the part of the route that is driven: two of them, with a rim on either
/// side and the marks of the grousers across. A pure function of the place and of that distance.
class WheelTracks : public GroundLayer {
 public:
  WheelTracks(const Route& route, double track_m) : route_(route), half_track_m_(0.5 * track_m) {}

  /// The rover stands after `s_m` of the route. Ruts end some metres behind it, in steps, so that they seldom change.
  void set_driven(double s_m);
  void add_to(Patch& patch) const override;
  std::uint64_t revision() const override { return steps_; }

 private:
  const Route& route_;
  double half_track_m_;
  std::uint64_t steps_ = 0;  ///< of kStep metres that are driven
};

}  // namespace demslam

#pragma once

#include <array>

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/dem/dem.h"
#include "demslam/dem/error_model.h"

namespace demslam {

/// How many times larger the DEM's error is than was said, as the patches of a drive tell. Each is held against the DEM
/// where the estimate puts it, with what the pose may still be off by taken out (height, tilt, and a shift along the
/// DEM's slopes), so that only the shape counts: restricted maximum likelihood of the error's scale (Patterson and
/// Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58, 1971) on a grid, with a
/// prior that what was said is about right, and slowly forgetting. Never below 1: fewer errors than stated are no
/// reason to trust a map more than its makers do.
class DemNoise {
 public:
  /// A patch at its present pose, on the DEM as given, of the error as stated.
  void add(const TerrainPatch& patch, const Pose& T_map_body, const Dem& dem, const DemErrorModel& stated);
  double scale() const;

 private:
  static constexpr int kScales = 49;  ///< from a quarter to 16 times
  static double scale_at(int i);

  std::array<double, kScales> log_likelihood_{};
};

}  // namespace demslam

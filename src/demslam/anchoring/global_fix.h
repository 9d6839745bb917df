#pragma once

#include <memory>
#include <optional>

#include "demslam/anchoring/submap_alignment.h"

namespace demslam {

/// Position without a start: the ground seen so far against everything within a radius.
struct GlobalFixOptions {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();  ///< of the search, map
  double radius_m = 200.0;
  std::optional<double> heading_rad;   ///< of the submap's keyframe, where something tells it; otherwise all are tried
  double heading_tolerance_rad = 0.1;  ///< both ways
  double step_m = 5.0;
  double sigma_tilt_deg = 1.0;
  FixAcceptance acceptance{.peak_chi_square = 30.0, .min_cells = 40};
};

/// Finds the submap within the radius. `T_level_body`: its keyframe's attitude, of which roll and pitch are believed
/// (accelerometers, or a rover standing on known ground) and the rest is not. "No fix" is every status but accepted.
TerrainFix global_fix(const TerrainPatch& submap, const Pose& T_level_body, std::shared_ptr<const Dem> dem,
                      const DemErrorModel& dem_error, const PatchFactorOptions& factor,
                      const GlobalFixOptions& options);

}  // namespace demslam

#include "demslam/anchoring/global_fix.h"

#include <numbers>
#include <utility>

#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

/// The attitude's roll and pitch at the heading and place where the search begins.
Pose search_centre(const Pose& T_level_body, const GlobalFixOptions& options) {
  const double turn = options.heading_rad.value_or(0.0) - yaw_of(T_level_body.rotation());
  const Eigen::Quaterniond upright(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  return {upright * T_level_body.rotation(), {options.centre_m.x(), options.centre_m.y(), 0.0}};
}

}  // namespace

TerrainFix global_fix(const TerrainPatch& submap, const Pose& T_level_body, std::shared_ptr<const Dem> dem,
                      const DemErrorModel& dem_error, const PatchFactorOptions& factor,
                      const GlobalFixOptions& options) {
  const SearchWindow window{.radius_m = options.radius_m,
                            .step_m = options.step_m,
                            .heading_rad = options.heading_rad ? options.heading_tolerance_rad : std::numbers::pi};
  return judged({submap, search_centre(T_level_body, options), std::move(dem), dem_error, factor,
                 options.sigma_tilt_deg * kRadPerDeg, window},
                options.acceptance);
}

}  // namespace demslam

#include "demslam/anchoring/global_fix.h"

#include <cmath>
#include <numbers>
#include <utility>


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
  if (std::ssize(submap.cells) < options.acceptance.min_cells) return {.cells = submap.cells.size()};
  const double sigma_tilt_rad = options.sigma_tilt_deg * std::numbers::pi / 180.0;
  const TerrainSearch search(submap, search_centre(T_level_body, options), dem, dem_error, factor, sigma_tilt_rad);
  const SearchWindow window{.radius_m = options.radius_m,
                            .step_m = options.step_m,
                            .heading_rad = options.heading_rad ? options.heading_tolerance_rad : std::numbers::pi};
  return judged(search, search.scan(window), options.acceptance);
}

}  // namespace demslam

#include "demslam/anchoring/start_search.h"

#include <utility>

namespace demslam {
namespace {

/// Room for the slope inside a cell, which no DEM takes out yet.
PatchOptions without_dem(PatchOptions patch) {
  patch.gate_m += 1.0;
  return patch;
}

}  // namespace

StartSearch::StartSearch(std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error, const PatchOptions& patch,
                         const PatchFactorOptions& factor, const StartSearchOptions& options, const Pose& T_body_left)
    : dem_(std::move(dem)),
      dem_error_(dem_error),
      patch_(without_dem(patch)),
      factor_(factor),
      options_(options),
      ground_(options.length_m, T_body_left) {}

std::optional<Pose> StartSearch::advance(const PoseGraph& graph, std::size_t keyframe, double step_m) {
  ground_.advance(keyframe, step_m);
  if (ground_.path_m() < options_.first_m || ground_.path_m() - searched_at_m_ < options_.every_m) return std::nullopt;
  searched_at_m_ = ground_.path_m();
  keyframe_ = ground_.middle();
  const Pose& T_level_body = graph.T_map_body(keyframe_);
  const auto submap = build_patch(ground_.views(graph), keyframe_, T_level_body, patch_);
  if (!submap) return std::nullopt;
  ++searches_;
  GlobalFixOptions options = options_.fix;
  options.radius_m += T_level_body.translation().head<2>().norm();
  if (options.heading_rad) *options.heading_rad += yaw_of(T_level_body.rotation());
  fix_ = global_fix(*submap, T_level_body, dem_, dem_error_, factor_, options);
  if (!fix_.accepted()) return std::nullopt;
  return fix_.T_map_body * T_level_body.inverse();
}

}  // namespace demslam

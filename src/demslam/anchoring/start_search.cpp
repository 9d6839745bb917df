#include "demslam/anchoring/start_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "demslam/geometry/covariance.h"

namespace demslam {
namespace {

/// Room for the slope inside a cell, which no DEM takes out yet.
PatchOptions without_dem(PatchOptions patch) {
  patch.gate_m += 1.0;
  return patch;
}

}  // namespace

std::optional<StartSearchOptions> search_for_vague_start(const Pose& T_map_body, const Matrix6d& covariance,
                                                         double vague_m) {
  if (vague_m <= 0.0 || horizontal_sigma_m(T_map_body, covariance) <= vague_m) return std::nullopt;
  constexpr double kLength_m = 300.0;  // a small window: more ground is cheap, and seldom like that of another place
  return StartSearchOptions{.around = covariance, .length_m = kLength_m};
}

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
  const auto bend = ground_.bend(graph);
  if (!submap || !bend) return std::nullopt;
  ++searches_;
  fix_ = global_fix(*submap, T_level_body, dem_, dem_error_, factor_, window(graph));
  if (!fix_.accepted()) return std::nullopt;
  fix_.covariance += *bend;
  return fix_.T_map_body * T_level_body.inverse();
}

/// Where keyframe_ may be.
GlobalFixOptions StartSearch::window(const PoseGraph& graph) const {
  const Pose& T_map_begin = graph.T_map_body(0);
  const Pose& T_map_body = graph.T_map_body(keyframe_);
  const double way_m = (T_map_body.translation() - T_map_begin.translation()).head<2>().norm();
  GlobalFixOptions window = options_.fix;
  if (options_.around) {
    constexpr double kSigmas = 3.0, kLeast_m = 30.0, kMost_m = 500.0;  // beyond, a search takes minutes
    const double sigma_rad = heading_sigma_rad(T_map_begin, *options_.around);
    const double sigma_m = std::hypot(horizontal_sigma_m(T_map_begin, *options_.around), sigma_rad * way_m);
    window.centre_m = T_map_body.translation().head<2>();
    window.radius_m = std::clamp(kSigmas * sigma_m, kLeast_m, kMost_m);
    window.heading_rad = yaw_of(T_map_body.rotation());
    window.heading_tolerance_rad = kSigmas * sigma_rad;
  } else {
    window.radius_m += way_m;
    if (window.heading_rad) *window.heading_rad += yaw_of(T_map_body.rotation());
  }
  return window;
}

}  // namespace demslam

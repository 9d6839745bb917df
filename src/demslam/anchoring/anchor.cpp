#include "demslam/anchoring/anchor.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <numbers>
#include <utility>

#include "demslam/anchoring/dem_factors.h"
#include "demslam/anchoring/patch_factor.h"
#include "demslam/dem/wiener.h"

namespace demslam {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

gtsam::SharedNoiseModel robust(int rows, double sigma, double kernel_sigmas) {
  return gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(kernel_sigmas),
                                           gtsam::noiseModel::Isotropic::Sigma(rows, sigma));
}

TerrainGradient gradient(const AnchoringOptions& options) {
  return options.full_gradient ? TerrainGradient::full : TerrainGradient::vertical_only;
}

double tilt_of(const Pose& T_map_body) {
  return std::acos(std::clamp((T_map_body.rotation() * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

}  // namespace

DemAnchor::DemAnchor(std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                     const Eigen::Vector3d& p_body_ground, const Pose& T_body_left)
    : dem_(std::move(dem)),
      options_(options),
      error_{options.sigma_dem_m, options.dem_correlation_m},
      p_body_ground_(p_body_ground),
      T_body_left_(T_body_left) {
  if (!options.filter_dem) return;
  FilteredDem filtered = wiener_filtered(dem_->raster(), error_);
  dem_ = std::make_shared<Dem>(std::move(filtered.dem), dem_->interpolation());
  error_ = filtered.remaining;
}

void DemAnchor::add_landmarks(KeyframeLandmarks landmarks) {
  if (options_.patches) landmarks_.push_back(std::move(landmarks));
}

void DemAnchor::update(PoseGraph& graph) {
  for (; seen_ < graph.size(); ++seen_) {
    const double step_m =
        seen_ == 0 ? 0.0 : (graph.T_map_body(seen_).translation() - graph.T_map_body(seen_ - 1).translation()).norm();
    path_since_anchor_m_ += step_m;
    stretch_m_ += step_m;
    if (seen_ == 0 || path_since_anchor_m_ >= options_.spacing_m) {
      anchor(graph, seen_);
      path_since_anchor_m_ = 0.0;
    }
    if (options_.patches && stretch_m_ >= options_.patch.length_m) close_stretch(graph, seen_);
  }
}

void DemAnchor::anchor(PoseGraph& graph, std::size_t keyframe) {
  if (!options_.height && !options_.normal) return;
  const Eigen::Vector3d ground = graph.T_map_body(keyframe) * p_body_ground_;
  if (!dem_->covers(ground.x(), ground.y())) {
    ++report_.skipped_outside;
    return;
  }
  if (options_.height) {
    const auto noise = robust(1, std::hypot(error_.sigma_m, options_.sigma_contact_m), options_.kernel_sigmas);
    graph.add_factor(boost::make_shared<DemHeightFactor>(keyframe, dem_, p_body_ground_, noise, gradient(options_)));
    ++report_.height;
  }
  if (options_.normal) add_normal(graph, keyframe);
}

void DemAnchor::add_normal(PoseGraph& graph, std::size_t keyframe) {
  if (tilt_of(graph.T_map_body(keyframe)) > options_.max_tilt_deg * kRadPerDeg) {
    ++report_.skipped_tilt;
    return;
  }
  const auto noise = robust(2, options_.sigma_normal_deg * kRadPerDeg, options_.kernel_sigmas);
  graph.add_factor(boost::make_shared<DemNormalFactor>(keyframe, dem_, p_body_ground_, noise, gradient(options_)));
  ++report_.normal;
}

void DemAnchor::close_stretch(PoseGraph& graph, std::size_t end) {
  const std::size_t middle = (stretch_begin_ + end) / 2;
  std::vector<PosedLandmarks> stretch;
  for (const KeyframeLandmarks& seen : landmarks_) {
    if (seen.keyframe <= end) stretch.push_back({graph.T_map_body(seen.keyframe) * T_body_left_, &seen.points});
  }
  const auto patch = build_patch(stretch, middle, graph.T_map_body(middle), *dem_, options_.patch);
  if (patch) {
    graph.add_factor(boost::make_shared<TerrainPatchFactor>(*patch, dem_, error_, options_.patch_factor));
    ++report_.patches;
    report_.patch_cells += static_cast<int>(patch->cells.size());
  } else {
    ++report_.skipped_patches;
  }
  std::erase_if(landmarks_, [&](const KeyframeLandmarks& seen) { return seen.keyframe <= end; });
  stretch_begin_ = end + 1;
  stretch_m_ = 0.0;
}

AnchoringReport add_dem_factors(PoseGraph& graph, std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                                const Eigen::Vector3d& p_body_ground) {
  DemAnchor anchor(std::move(dem), options, p_body_ground);
  anchor.update(graph);
  return anchor.report();
}

}  // namespace demslam

#include "demslam/anchoring/anchor.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <numbers>
#include <utility>

#include "demslam/anchoring/dem_factors.h"

namespace demslam {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

gtsam::SharedNoiseModel robust(int rows, double sigma, double kernel_sigmas) {
  return gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(kernel_sigmas),
                                           gtsam::noiseModel::Isotropic::Sigma(rows, sigma));
}

double tilt_of(const Pose& T_map_body) {
  return std::acos(std::clamp((T_map_body.rotation() * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

}  // namespace

DemAnchor::DemAnchor(std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                     const Eigen::Vector3d& p_body_ground)
    : dem_(std::move(dem)), options_(options), p_body_ground_(p_body_ground) {}

void DemAnchor::update(PoseGraph& graph) {
  for (; seen_ < graph.size(); ++seen_) {
    if (seen_ > 0) {
      path_since_anchor_m_ +=
          (graph.T_map_body(seen_).translation() - graph.T_map_body(seen_ - 1).translation()).norm();
    }
    if (seen_ == 0 || path_since_anchor_m_ >= options_.spacing_m) {
      anchor(graph, seen_);
      path_since_anchor_m_ = 0.0;
    }
  }
}

void DemAnchor::anchor(PoseGraph& graph, std::size_t keyframe) {
  const Pose& T_map_body = graph.T_map_body(keyframe);
  const Eigen::Vector3d ground = T_map_body * p_body_ground_;
  if (!dem_->covers(ground.x(), ground.y())) {
    ++report_.skipped_outside;
    return;
  }
  const TerrainGradient gradient = options_.full_gradient ? TerrainGradient::full : TerrainGradient::vertical_only;
  const double sigma_m = std::hypot(options_.sigma_dem_m, options_.sigma_contact_m);
  graph.add_factor(boost::make_shared<DemHeightFactor>(keyframe, dem_, p_body_ground_,
                                                       robust(1, sigma_m, options_.kernel_sigmas), gradient));
  ++report_.height;
  if (!options_.normal) return;
  if (tilt_of(T_map_body) > options_.max_tilt_deg * kRadPerDeg) {
    ++report_.skipped_tilt;
    return;
  }
  const auto noise = robust(2, options_.sigma_normal_deg * kRadPerDeg, options_.kernel_sigmas);
  graph.add_factor(boost::make_shared<DemNormalFactor>(keyframe, dem_, p_body_ground_, noise, gradient));
  ++report_.normal;
}

AnchoringReport add_dem_factors(PoseGraph& graph, std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                                const Eigen::Vector3d& p_body_ground) {
  DemAnchor anchor(std::move(dem), options, p_body_ground);
  anchor.update(graph);
  return anchor.report();
}

}  // namespace demslam

#include "demslam/experiment/estimator.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "demslam/anchoring/sky_factors.h"
#include "demslam/base/time.h"
#include "demslam/slam/options.h"

namespace demslam {
namespace {

double root_mean(double sum, std::size_t count) { return std::sqrt(sum / static_cast<double>(count)); }

EstimateScore score(const Traverse& traverse, const PoseGraph& graph) {
  EstimateScore result;
  double horizontal = 0.0, vertical = 0.0;
  std::vector<std::size_t> checked;
  const std::size_t n = graph.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Eigen::Vector3d error = graph.T_map_body(k).translation() - traverse.T_map_body[k].translation();
    horizontal += error.head<2>().squaredNorm();
    vertical += error.z() * error.z();
    if (k > 0 && k % std::max<std::size_t>(1, n / 12) == 0) checked.push_back(k);
    result.end_m = error.norm();
  }
  result.ate_m = root_mean(horizontal + vertical, n);
  result.horizontal_m = root_mean(horizontal, n);
  result.vertical_m = root_mean(vertical, n);
  const auto covariances = graph.covariances(checked);
  for (std::size_t c = 0; c < checked.size(); ++c) {
    const Pose& T_map_body = graph.T_map_body(checked[c]);
    const Eigen::Vector3d error =
        T_map_body.inverse() * traverse.T_map_body[checked[c]].translation();  // in the body, as the covariance
    const Eigen::Matrix3d of_position = covariances[c].bottomRightCorner<3, 3>();
    result.nees += error.dot(of_position.ldlt().solve(error)) / (3.0 * static_cast<double>(checked.size()));
  }
  return result;
}

/// One estimator under way.
class Drive {
 public:
  Drive(const Traverse& traverse, const Estimator& estimator)
      : traverse_(traverse), estimator_(estimator), graph_({.systematic = estimator.systematic}) {
    if (estimator.anchored) {
      anchor_.emplace(std::make_shared<Dem>(traverse.dem), estimator.anchoring, Eigen::Vector3d::Zero(),
                      traverse.T_body_left);
      const auto search =
          search_for_vague_start(traverse.T_map_start, traverse.start_covariance, estimator.anchoring.vague_start_m);
      if (search) anchor_->search_start(*search);
    }
    graph_.add_keyframe(traverse.T_map_start);
    graph_.add_prior(0, traverse.T_map_start, traverse.start_covariance);
    look(0);
  }

  void advance(const RelativePose& motion) {
    graph_.add_keyframe(graph_.T_map_body(motion.i) * graph_.corrected_odometry(motion));
    graph_.add_odometry(motion);
    const double step_m = motion.T_i_j.translation().norm();
    since_sun_m_ += step_m;
    since_optimised_m_ += step_m;
    look(motion.j);
    if ((!anchor_ && !estimator_.sun) || since_optimised_m_ < estimator_.optimise_every_m) return;
    since_optimised_m_ = 0.0;
    const auto length = static_cast<std::size_t>(std::ceil(estimator_.window_m / step_m));
    graph_.optimize_window(motion.j > length ? motion.j - length : 0);
  }

  PoseGraph& graph() { return graph_; }
  AnchoringReport anchoring() const { return anchor_ ? anchor_->report() : AnchoringReport{}; }
  std::optional<DemShift> dem_shift() const { return anchor_ ? anchor_->dem_shift(graph_) : std::nullopt; }

 private:
  void look(std::size_t keyframe) {
    if (estimator_.sun && since_sun_m_ >= estimator_.sun_every_m) see_sun(keyframe);
    if (!anchor_) return;
    anchor_->add_landmarks(traverse_.landmarks[keyframe]);
    anchor_->update(graph_);
  }

  void see_sun(std::size_t keyframe) {
    since_sun_m_ = 0.0;
    graph_.add_factor(sun_factor(keyframe, traverse_.sun_map, traverse_.sun_body[keyframe], estimator_.sun_sigma_deg));
  }

  const Traverse& traverse_;
  const Estimator& estimator_;
  PoseGraph graph_;
  std::optional<DemAnchor> anchor_;
  double since_optimised_m_ = 0.0, since_sun_m_ = 0.0;
};

}  // namespace

Estimator odometry_only() {
  return {.name = "odometry", .anchored = false, .systematic = OdometryErrors().as_states()};
}

Estimator published_factors() {
  Estimator estimator{.name = "published factors"};
  estimator.anchoring.full_gradient = estimator.anchoring.gate = estimator.anchoring.alike_errors = false;
  return estimator;
}

Estimator full_gradient() {
  Estimator estimator{.name = "full gradient"};
  estimator.anchoring.gate = estimator.anchoring.alike_errors = false;
  return estimator;
}

Estimator full_gradient_states() {
  return {.name = "gated full gradient + states", .systematic = OdometryErrors().as_states()};
}

Estimator terrain_patches() {
  Estimator estimator{.name = "patches + states", .systematic = OdometryErrors().as_states()};
  estimator.anchoring.height = estimator.anchoring.normal = false;
  estimator.anchoring.patches = true;
  estimator.anchoring.gate = false;
  return estimator;
}

Estimator filtered_patches() {
  Estimator estimator = terrain_patches();
  estimator.name = "filtered patches + states";
  estimator.anchoring.filter_dem = estimator.anchoring.estimate_noise = true;
  estimator.anchoring.gate = true;
  return estimator;
}

Estimator submaps() {
  Estimator estimator = filtered_patches();
  estimator.name = "submaps + states";
  estimator.anchoring.patches = false;
  estimator.anchoring.submap.factors = estimator.anchoring.submap.recover = true;
  return estimator;
}

Estimator everything() {
  Estimator estimator = filtered_patches();
  estimator.name = "all";
  estimator.anchoring.submap.recover = true;
  estimator.anchoring.vague_start_m = SlamOptions().anchoring.vague_start_m;
  return estimator;
}

Estimator shipped() {
  Estimator estimator{.name = "default"};
  const SlamOptions options;
  estimator.anchoring = options.anchoring;
  estimator.systematic = OdometryErrors().as_states();
  return estimator;
}

Estimator trusting_the_dem() {
  Estimator estimator = shipped();
  estimator.name = "default, DEM in its place";
  estimator.anchoring.sigma_bias_m = estimator.anchoring.sigma_shift_m = 0.0;
  return estimator;
}

Estimator with_sun(Estimator estimator) {
  estimator.name += " + sun";
  estimator.sun = true;
  return estimator;
}

std::vector<Estimator> terrain_estimators() {
  return {odometry_only(),
          published_factors(),
          full_gradient(),
          full_gradient_states(),
          terrain_patches(),
          filtered_patches(),
          shipped(),
          trusting_the_dem(),
          submaps(),
          everything(),
          with_sun(odometry_only()),
          with_sun(everything())};
}

EstimateScore estimate(const Traverse& traverse, const Estimator& estimator) {
  const Stopwatch watch;
  Drive drive(traverse, estimator);
  for (const RelativePose& motion : traverse.odometry) drive.advance(motion);
  const double driving_ms = watch.elapsed_ms();
  const OptimizerReport batch = drive.graph().optimize();
  EstimateScore result = score(traverse, drive.graph());
  result.ms_per_keyframe = driving_ms / static_cast<double>(traverse.T_map_body.size());
  result.batch_ms = batch.milliseconds;
  result.anchoring = drive.anchoring();
  result.dem_shift = drive.dem_shift();
  return result;
}

}  // namespace demslam

#include "demslam/experiment/estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "demslam/base/time.h"

namespace demslam {
namespace {

constexpr double kStartSigma_m = 0.01, kStartSigma_rad = 0.01 * std::numbers::pi / 180.0;

Matrix6d start_covariance() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(kStartSigma_rad * kStartSigma_rad),
      Eigen::Vector3d::Constant(kStartSigma_m * kStartSigma_m);
  return variance.asDiagonal();
}

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
    }
    graph_.add_keyframe(traverse.T_map_body.front());
    graph_.add_prior(0, traverse.T_map_body.front(), start_covariance());
    look(0);
  }

  void advance(const RelativePose& motion) {
    graph_.add_keyframe(graph_.T_map_body(motion.i) * graph_.corrected_odometry(motion));
    graph_.add_odometry(motion);
    look(motion.j);
    const double step_m = motion.T_i_j.translation().norm();
    since_optimised_m_ += step_m;
    if (!anchor_ || since_optimised_m_ < estimator_.optimise_every_m) return;
    since_optimised_m_ = 0.0;
    const auto length = static_cast<std::size_t>(std::ceil(estimator_.window_m / step_m));
    graph_.optimize_window(motion.j > length ? motion.j - length : 0);
  }

  PoseGraph& graph() { return graph_; }
  AnchoringReport anchoring() const { return anchor_ ? anchor_->report() : AnchoringReport{}; }

 private:
  void look(std::size_t keyframe) {
    if (!anchor_) return;
    anchor_->add_landmarks(traverse_.landmarks[keyframe]);
    anchor_->update(graph_);
  }

  const Traverse& traverse_;
  const Estimator& estimator_;
  PoseGraph graph_;
  std::optional<DemAnchor> anchor_;
  double since_optimised_m_ = 0.0;
};

}  // namespace

Estimator odometry_only() { return {.name = "odometry", .anchored = false}; }

Estimator published_factors() {
  Estimator estimator{.name = "published factors"};
  estimator.anchoring.full_gradient = false;
  return estimator;
}

Estimator full_gradient() { return {.name = "full gradient"}; }

Estimator full_gradient_states() { return {.name = "full gradient + states", .systematic = {.enabled = true}}; }

Estimator terrain_patches() {
  Estimator estimator{.name = "terrain patches + states", .systematic = {.enabled = true}};
  estimator.anchoring.height = estimator.anchoring.normal = false;
  estimator.anchoring.patches = true;
  return estimator;
}

Estimator filtered_patches() {
  Estimator estimator = terrain_patches();
  estimator.name = "filtered terrain patches + states";
  estimator.anchoring.filter_dem = true;
  return estimator;
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
  return result;
}

}  // namespace demslam

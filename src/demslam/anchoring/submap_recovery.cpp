#include "demslam/anchoring/submap_recovery.h"

#include <gtsam/slam/PriorFactor.h>

#include <Eigen/LU>
#include <boost/make_shared.hpp>
#include <utility>

#include "demslam/geometry/covariance.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

constexpr double kPoseKernelSigmas = 5.0;   // Cauchy, of pose factors
constexpr double kChiSquareOfPlane = 11.8;  // 3 sigma of two degrees of freedom

/// The turn about the vertical and the shift that bring `from` to `to`; tilt is left to the graph.
Pose level_correction(const Pose& from, const Pose& to) {
  const double turn = yaw_of(to.rotation()) - yaw_of(from.rotation());
  const Eigen::Quaterniond R(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  return {R, to.translation() - R * from.translation()};
}

void add_pose_factor(PoseGraph& graph, std::size_t keyframe, const TerrainFix& fix) {
  const auto noise = gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(kPoseKernelSigmas),
                                                       gtsam::noiseModel::Gaussian::Covariance(fix.covariance));
  graph.add_factor(boost::make_shared<gtsam::PriorFactor<gtsam::Pose3>>(keyframe, to_gtsam(fix.T_map_body), noise));
}

}  // namespace

SubmapRecovery::SubmapRecovery(std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error,
                               const PatchOptions& patch, const PatchFactorOptions& factor,
                               const SubmapOptions& options, const Pose& T_body_left)
    : dem_(std::move(dem)),
      dem_error_(dem_error),
      patch_(patch),
      factor_(factor),
      options_(options),
      ground_(options.length_m, T_body_left) {}

void SubmapRecovery::advance(PoseGraph& graph, std::size_t keyframe, double step_m) {
  ground_.advance(keyframe, step_m);
  if (ground_.path_m() < options_.length_m || ground_.path_m() - searched_at_m_ < options_.every_m) return;
  searched_at_m_ = ground_.path_m();
  search(graph);
}

void SubmapRecovery::search(PoseGraph& graph) {
  const std::size_t middle = ground_.middle();
  const auto submap = build_patch(ground_.views(graph), middle, graph.T_map_body(middle), *dem_, patch_);
  const auto bend = ground_.bend(graph);
  if (!submap || !bend) return;
  ++report_.searched;
  TerrainFix fix =
      align_submap(*submap, graph.T_map_body(middle), graph.newest_covariance(), dem_, dem_error_, factor_, options_);
  if (!fix.accepted()) return;
  fix.covariance += *bend;
  ++report_.accepted;
  use(graph, middle, fix);
}

/// True when the fix agrees with the graph's covariance, or with the correction that the search before asked for.
bool SubmapRecovery::believed(const PoseGraph& graph, const TerrainFix& fix, const Pose& T_correction) {
  const Pose& T_map_body = graph.T_map_body(ground_.reached());
  const Eigen::Vector2d shift = (T_correction * T_map_body.translation() - T_map_body.translation()).head<2>();
  const Eigen::Matrix3d position =
      position_covariance(T_map_body, graph.newest_covariance()) + position_covariance(fix.T_map_body, fix.covariance);
  const Eigen::Matrix2d expected = position.topLeftCorner<2, 2>();
  if (shift.dot(expected.inverse() * shift) < kChiSquareOfPlane) return true;
  const Pose before = pending_.value_or(Pose());
  const Eigen::Vector3d p = T_map_body.translation();
  const bool confirmed = pending_ && (before * p - T_correction * p).head<2>().norm() < options_.disagree_m;
  pending_ = T_correction;
  return confirmed;
}

void SubmapRecovery::use(PoseGraph& graph, std::size_t keyframe, const TerrainFix& fix) {
  const Pose T_correction = level_correction(graph.T_map_body(keyframe), fix.T_map_body);
  const Eigen::Vector2d off = (fix.T_map_body.translation() - graph.T_map_body(keyframe).translation()).head<2>();
  const bool agrees = off.norm() <= options_.disagree_m;
  const bool move = options_.recover && !agrees && believed(graph, fix, T_correction);
  if (options_.factors || move) add_pose_factor(graph, keyframe, fix);
  if (move) {
    graph.move(sure_until_, T_correction);
    graph.optimize();
    ++report_.moved;
  }
  if (!agrees && !move) return;
  pending_.reset();
  sure_until_ = keyframe;
}

}  // namespace demslam

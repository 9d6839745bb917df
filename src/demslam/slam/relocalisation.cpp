#include "demslam/slam/relocalisation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

/// Largest standard deviation of the position.
double position_sigma_m(const Matrix6d& covariance) {
  const Eigen::Matrix3d of_position = covariance.bottomRightCorner<3, 3>();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(of_position).eigenvalues()[2]);
}

double heading_difference(const Pose& a, const Pose& b) {
  return std::abs(std::remainder(yaw_of(a.rotation()) - yaw_of(b.rotation()), 2.0 * std::numbers::pi));
}

/// Of a * b from those of both.
Matrix6d compose_covariance(const Matrix6d& covariance_a, const Pose& b, const Matrix6d& covariance_b) {
  const Matrix6d ad = b.inverse().adjoint();
  return ad * covariance_a * ad.transpose() + covariance_b;
}

Pose between_cameras(const Pose& T_i_j, const Pose& T_body_left) { return T_body_left.inverse() * T_i_j * T_body_left; }

/// What the images say, before the graph is asked.
LoopResult by_images(const Motion& motion, std::size_t i, std::size_t j, const Pose& T_body_left,
                     const LoopOptions& options) {
  LoopResult result{.reason = motion.reason, .inliers = motion.inliers};
  result.measurement = motion.ok ? body_measurement(motion, T_body_left, options) : RelativePose{};
  result.measurement.i = i;
  result.measurement.j = j;
  if (!motion.ok) return result;
  result.status = LoopStatus::inconsistent;
  if (motion.inliers >= options.min_inliers) return result;
  result.status = LoopStatus::not_matched;
  result.reason = "too few inliers (" + std::to_string(motion.inliers) + ")";
  return result;
}

void judge(LoopResult& result, double chi_square, const LoopOptions& options) {
  result.chi_square = chi_square;
  result.status = chi_square <= options.gate ? LoopStatus::accepted : LoopStatus::inconsistent;
  if (result.status != LoopStatus::accepted) result.reason = "chi-square " + std::to_string(chi_square);
}

}  // namespace

RelativePose body_measurement(const Motion& motion, const Pose& T_body_left, const LoopOptions& options) {
  const Matrix6d ad = T_body_left.adjoint();
  return {.T_i_j = T_body_left * motion.T_a_b * T_body_left.inverse(),
          .covariance = ad * motion.covariance * ad.transpose() + options.floor_covariance()};
}

std::vector<LoopResult> Relocaliser::look(PoseGraph& graph, bool lost, const ViewVerifier& verify) {
  const std::size_t newest = graph.size() - 1;
  if (lost && !first_behind_) first_behind_ = newest;
  std::vector<LoopResult> results;
  if (!first_behind_) return results;
  for (std::size_t n = 2; n <= kBefore && n <= *first_behind_; ++n) {  // the last one is tied by odometry
    results.push_back(attempt(graph, *first_behind_ - n, verify));
    if (results.back().status != LoopStatus::accepted) continue;
    graph.add_loop(results.back().measurement);
    ++found_;
    first_behind_.reset();
    return results;
  }
  if (newest - *first_behind_ + 1 >= kTries) first_behind_.reset();
  return results;
}

LoopResult Relocaliser::attempt(const PoseGraph& graph, std::size_t old_view, const ViewVerifier& verify) const {
  const std::size_t newest = graph.size() - 1;
  const Pose T_old_new = graph.T_map_body(old_view).inverse() * graph.T_map_body(newest);
  LoopResult result =
      by_images(verify(old_view, between_cameras(T_old_new, T_body_left_)), old_view, newest, T_body_left_, options_);
  if (result.status != LoopStatus::not_matched) judge(result, graph.chi_square(result.measurement), options_);
  return result;
}

EarlierMap::EarlierMap(const std::filesystem::path& file, const RectifiedRig& rig, const LoopOptions& options)
    : map_(MapStore::open_read_only(file)),
      T_body_left_(rig.T_body_left),
      options_(options),
      keyframes_(map_.estimates()) {
  const RectifiedRig theirs = map_.header().rig;
  const bool same = theirs.width == rig.width && std::abs(theirs.focal_px - rig.focal_px) < 1e-6 &&
                    std::abs(theirs.baseline_m - rig.baseline_m) < 1e-9;
  if (!same) throw Error(file.string() + ": was made with another stereo rig; --map needs the same one");
}

std::vector<std::size_t> EarlierMap::candidates(const Pose& T_map_body, const Matrix6d& covariance) const {
  const double radius_m = options_.radius_m + 3.0 * position_sigma_m(covariance);
  const double turn_rad =
      options_.max_heading_difference_deg * kRadPerDeg + 3.0 * std::sqrt(covariance.diagonal().head<3>().maxCoeff());
  std::vector<std::pair<double, std::size_t>> near;
  for (const StoredEstimate& old : keyframes_) {
    const double distance_m = (old.T_map_body.translation() - T_map_body.translation()).norm();
    if (distance_m <= radius_m && heading_difference(old.T_map_body, T_map_body) <= turn_rad)
      near.emplace_back(distance_m, old.keyframe);
  }
  std::ranges::sort(near);
  if (const std::size_t most = found_ == 0 ? kAtStart : kOnTheWay; near.size() > most) near.resize(most);
  std::vector<std::size_t> nearest;
  for (const auto& [distance_m, keyframe] : near) nearest.push_back(keyframe);
  return nearest;
}

std::vector<LoopResult> EarlierMap::look(PoseGraph& graph, const ViewVerifier& verify) {
  const Pose here = graph.T_map_body(graph.size() - 1);
  std::vector<LoopResult> results;
  if (found_ > 0 && (here.translation() - T_map_body_found_.translation()).norm() < kEvery_m) return results;
  const Matrix6d covariance = graph.newest_covariance();
  for (const std::size_t old_view : candidates(here, covariance)) {
    results.push_back(attempt(graph, old_view, covariance, verify));
    if (results.back().status == LoopStatus::accepted) break;
  }
  return results;
}

LoopResult EarlierMap::attempt(PoseGraph& graph, std::size_t old_view, const Matrix6d& covariance,
                               const ViewVerifier& verify) {
  const std::size_t newest = graph.size() - 1;
  const StoredEstimate& old = keyframes_[old_view];
  const Pose here = graph.T_map_body(newest);
  LoopResult result = by_images(verify(old_view, between_cameras(old.T_map_body.inverse() * here, T_body_left_)),
                                old_view, newest, T_body_left_, options_);
  if (result.status == LoopStatus::not_matched) return result;
  const RelativePose& m = result.measurement;
  const Pose T_map_body = old.T_map_body * m.T_i_j;
  const Matrix6d known = compose_covariance(old.covariance.value_or(m.covariance), m.T_i_j, m.covariance);
  const Vector6d deviation = (T_map_body.inverse() * here).log();
  judge(result, deviation.dot(Matrix6d(known + covariance).ldlt().solve(deviation)), options_);
  if (result.status != LoopStatus::accepted) return result;
  graph.add_prior(newest, T_map_body, known);
  T_map_body_found_ = T_map_body;
  ++found_;
  return result;
}

}  // namespace demslam

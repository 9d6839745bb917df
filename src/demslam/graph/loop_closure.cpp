#include "demslam/graph/loop_closure.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace demslam {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

double heading_difference(const Pose& a, const Pose& b) {
  return std::abs(std::remainder(yaw_of(a.rotation()) - yaw_of(b.rotation()), 2.0 * std::numbers::pi));
}

/// Largest horizontal standard deviation of a pose.
double horizontal_sigma_m(const Pose& T_map_body, const Matrix6d& covariance) {
  const Eigen::Matrix3d R = T_map_body.rotation_matrix();
  const Eigen::Matrix3d of_position = R * covariance.bottomRightCorner<3, 3>() * R.transpose();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(of_position.topLeftCorner<2, 2>()).eigenvalues()[1]);
}

Matrix6d floor_covariance(const LoopOptions& options) {
  Vector6d variance;
  variance.head<3>().setConstant(std::pow(options.sigma_floor_deg * kRadPerDeg, 2));
  variance.tail<3>().setConstant(std::pow(options.sigma_floor_m, 2));
  return variance.asDiagonal();
}

}  // namespace

LoopClosure::LoopClosure(const LoopOptions& options, const Pose& T_body_left, LoopVerifier verify)
    : options_(options), T_body_left_(T_body_left), verify_(std::move(verify)) {}

std::vector<std::size_t> LoopClosure::candidates(const PoseGraph& graph) {
  for (std::size_t k = path_m_.size(); k < graph.size(); ++k) {
    const auto step = [&] {
      return (graph.T_map_body(k).translation() - graph.T_map_body(k - 1).translation()).norm();
    };
    path_m_.push_back(k == 0 ? 0.0 : path_m_[k - 1] + step());
  }
  const std::size_t newest = graph.size() - 1;
  const Pose& here = graph.T_map_body(newest);
  std::vector<std::pair<double, std::size_t>> near;  // horizontal distance, keyframe
  for (std::size_t k = 0; k < newest && path_m_[newest] - path_m_[k] >= options_.min_path_m; ++k) {
    const Pose& there = graph.T_map_body(k);
    const double distance_m = (there.translation() - here.translation()).head<2>().norm();
    if (distance_m > options_.max_radius_m) continue;
    if (heading_difference(here, there) <= options_.max_heading_difference_deg * kRadPerDeg)
      near.emplace_back(distance_m, k);
  }
  if (near.empty()) return {};
  const double radius_m = options_.radius_m + 3.0 * horizontal_sigma_m(here, graph.covariances({newest}).front());
  std::erase_if(near, [&](const auto& candidate) { return candidate.first > radius_m; });
  std::sort(near.begin(), near.end());
  std::vector<std::size_t> nearest;
  for (std::size_t n = 0; n < near.size() && n < static_cast<std::size_t>(options_.max_candidates); ++n) {
    nearest.push_back(near[n].second);
  }
  return nearest;
}

LoopResult LoopClosure::attempt(const PoseGraph& graph, std::size_t i, std::size_t j) const {
  const Pose T_left_body = T_body_left_.inverse();
  const Pose guess = T_left_body * graph.T_map_body(i).inverse() * graph.T_map_body(j) * T_body_left_;
  const Motion motion = verify_(i, j, guess);
  LoopResult result{.measurement = {.i = i, .j = j}, .inliers = motion.inliers};
  if (!motion.ok) {
    result.reason = motion.reason;
    return result;
  }
  if (motion.inliers < options_.min_inliers) {
    result.reason = "too few inliers (" + std::to_string(motion.inliers) + ")";
    return result;
  }
  const Matrix6d A = T_body_left_.adjoint();
  result.measurement.T_i_j = T_body_left_ * motion.T_a_b * T_left_body;
  result.measurement.covariance = A * motion.covariance * A.transpose() + floor_covariance(options_);
  result.chi_square = graph.chi_square(result.measurement);
  const bool plausible = result.chi_square <= options_.gate;
  result.status = plausible ? LoopStatus::accepted : LoopStatus::inconsistent;
  if (!plausible) result.reason = "chi-square " + std::to_string(result.chi_square) + " against the graph";
  return result;
}

std::vector<LoopResult> LoopClosure::close(PoseGraph& graph) {
  std::vector<LoopResult> results;
  if (graph.size() < 2) return results;
  const std::size_t newest = graph.size() - 1;
  for (const std::size_t candidate : candidates(graph)) {
    results.push_back(attempt(graph, candidate, newest));
    ++counters_.proposed;
    counters_.verified += results.back().status != LoopStatus::not_matched;
    counters_.rejected += results.back().status == LoopStatus::inconsistent;
    counters_.accepted += results.back().status == LoopStatus::accepted;
  }
  for (const LoopResult& result : results) {
    if (result.status == LoopStatus::accepted) graph.add_loop(result.measurement);
  }
  return results;
}

}  // namespace demslam

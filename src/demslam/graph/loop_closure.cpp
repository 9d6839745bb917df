#include "demslam/graph/loop_closure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "demslam/geometry/angle.h"
#include "demslam/geometry/covariance.h"

namespace demslam {
namespace {

double heading_difference(const Pose& a, const Pose& b) {
  return std::abs(std::remainder(yaw_of(a.rotation()) - yaw_of(b.rotation()), 2.0 * std::numbers::pi));
}

constexpr double kCell_m = 10.0;

/// A loop that was tried just now and has changed since is reported once, as it is.
void merge(std::vector<LoopResult>& results, std::vector<LoopResult> changed) {
  for (LoopResult& loop : changed) {
    const auto same = std::find_if(results.begin(), results.end(), [&](const LoopResult& r) {
      return r.status == LoopStatus::unconfirmed && r.measurement.i == loop.measurement.i &&
             r.measurement.j == loop.measurement.j;
    });
    if (same != results.end()) {
      *same = std::move(loop);
    } else {
      results.push_back(std::move(loop));
    }
  }
}

}  // namespace

Matrix6d LoopOptions::floor_covariance() const {
  Vector6d variance;
  variance.head<3>().setConstant(std::pow(sigma_floor_deg * kRadPerDeg, 2));
  variance.tail<3>().setConstant(std::pow(sigma_floor_m, 2));
  return variance.asDiagonal();
}

LoopClosure::LoopClosure(const LoopOptions& options, const Pose& T_body_left, LoopVerifier verify,
                         AppearanceSource appearance)
    : options_(options),
      T_body_left_(T_body_left),
      verify_(std::move(verify)),
      appearance_(std::move(appearance)),
      grid_(kCell_m) {}

void LoopClosure::index_until(const PoseGraph& graph, std::size_t end) {
  if (batches_ != graph.batches()) {
    batches_ = graph.batches();
    grid_.clear();
    indexed_ = 0;
  }
  for (; indexed_ < end; ++indexed_) grid_.add(indexed_, graph.T_map_body(indexed_).translation().head<2>());
}

std::vector<std::size_t> LoopClosure::near(const PoseGraph& graph) {
  const std::size_t newest = graph.size() - 1;
  const Pose& here = graph.T_map_body(newest);
  const double radius_m = options_.radius_m + 3.0 * horizontal_sigma_m(here, graph.newest_covariance());
  if (radius_m > options_.max_radius_m && appearance_) return appearance_(newest, indexed_);
  const double reach_m = std::min(radius_m, options_.max_radius_m);
  std::vector<std::pair<double, std::size_t>> found;  // horizontal distance, keyframe
  for (const std::size_t k : grid_.around(here.translation().head<2>(), reach_m)) {
    const Pose& there = graph.T_map_body(k);
    const double distance_m = (there.translation() - here.translation()).head<2>().norm();
    if (distance_m > reach_m) continue;
    if (heading_difference(here, there) <= options_.max_heading_difference_deg * kRadPerDeg)
      found.emplace_back(distance_m, k);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::size_t> nearest;
  nearest.reserve(found.size());
  for (const auto& [distance_m, keyframe] : found) nearest.push_back(keyframe);
  return nearest;
}

std::vector<std::size_t> LoopClosure::candidates(const PoseGraph& graph) {
  const double path_m = graph.path_m(graph.size() - 1);
  std::size_t end = indexed_;
  while (end + 1 < graph.size() && path_m - graph.path_m(end) >= options_.min_path_m) ++end;
  index_until(graph, end);
  if (path_m < quiet_until_m_ || end == 0) return {};
  std::vector<std::size_t> chosen = near(graph);
  std::erase_if(chosen, [&](std::size_t k) { return k >= end; });
  if (chosen.size() > static_cast<std::size_t>(options_.max_candidates))
    chosen.resize(static_cast<std::size_t>(options_.max_candidates));
  return chosen;
}

LoopResult LoopClosure::attempt(const PoseGraph& graph, std::size_t i) {
  const std::size_t newest = graph.size() - 1;
  const Pose T_i_j = graph.T_map_body(i).inverse() * graph.T_map_body(newest);
  return consider(graph, i, verify_(i, newest, T_body_left_.inverse() * T_i_j * T_body_left_));
}

LoopResult LoopClosure::consider(const PoseGraph& graph, std::size_t i, const Motion& motion) {
  const LoopResult result = measured(graph, i, motion);
  ++counters_.proposed;
  counters_.verified += result.status != LoopStatus::not_matched;
  counters_.rejected += result.status == LoopStatus::inconsistent;
  if (result.status == LoopStatus::unconfirmed) wait(graph, result);
  return result;
}

LoopResult LoopClosure::measured(const PoseGraph& graph, std::size_t i, const Motion& motion) const {
  LoopResult result{.measurement = {.i = i, .j = graph.size() - 1}, .inliers = motion.inliers};
  if (!motion.ok) {
    result.reason = motion.reason;
    return result;
  }
  if (motion.inliers < options_.min_inliers) {
    result.reason = "too few inliers (" + std::to_string(motion.inliers) + ")";
    return result;
  }
  const Matrix6d A = T_body_left_.adjoint();
  result.measurement.T_i_j = T_body_left_ * motion.T_a_b * T_body_left_.inverse();
  result.measurement.covariance = A * motion.covariance * A.transpose() + options_.floor_covariance();
  judge(graph, result);
  return result;
}

/// The graph may be wrong, if it holds a false loop: what the odometry believes is not thrown away.
void LoopClosure::judge(const PoseGraph& graph, LoopResult& result) const {
  result.chi_square = graph.chi_square(result.measurement);
  result.status = LoopStatus::unconfirmed;
  if (result.chi_square <= options_.gate) return;
  result.reason = "chi-square " + std::to_string(result.chi_square) + " against the graph";
  const auto by_odometry = graph.odometry_chi_square(result.measurement);
  if (!by_odometry || *by_odometry > options_.gate) result.status = LoopStatus::inconsistent;
}

std::vector<LoopResult> LoopClosure::close(PoseGraph& graph) {
  std::vector<LoopResult> results;
  if (graph.size() < 2) return results;
  if (reviewed_ != graph.batches()) results = review(graph);
  reviewed_ = graph.batches();
  for (const std::size_t i : candidates(graph)) results.push_back(attempt(graph, i));
  std::vector<LoopResult> changed;
  confirm(graph, changed);
  expire(graph, changed);
  merge(results, std::move(changed));
  return results;
}

}  // namespace demslam

#include "demslam/evaluation/clock_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "demslam/base/error.h"
#include "demslam/evaluation/metrics.h"

namespace demslam {
namespace {

constexpr std::size_t kMostPoses = 2000;              // of the estimate; more only cost time
constexpr TimestampNs kLongestGapNs = 2'000'000'000;  // of the truth; no interpolation across more
constexpr double kScanStepS = 0.5, kPrecisionS = 1e-3;
constexpr double kLeastOverlap = 0.8;  // of the best overlap found, lest few poses agree by chance

std::optional<Eigen::Vector3d> interpolated(const Trajectory& truth, TimestampNs t_ns) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), t_ns,
                                      [](const StampedPose& pose, TimestampNs t) { return pose.t_ns < t; });
  if (after == truth.begin() || after == truth.end()) return std::nullopt;
  const StampedPose &a = *(after - 1), &b = *after;
  if (b.t_ns - a.t_ns > kLongestGapNs) return std::nullopt;
  const double share = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  return (1.0 - share) * a.pose.translation() + share * b.pose.translation();
}

PosePairs pairs_at(const Trajectory& truth, const Trajectory& estimate, double offset_s) {
  PosePairs pairs;
  for (const StampedPose& pose : estimate) {
    const auto p = interpolated(truth, pose.t_ns + std::llround(offset_s * 1e9));
    if (!p) continue;
    pairs.truth.push_back({pose.t_ns, Pose(Eigen::Quaterniond::Identity(), *p)});
    pairs.estimate.push_back(pose);
  }
  return pairs;
}

struct Candidate {
  double offset_s = 0.0, rmse_m = std::numeric_limits<double>::infinity();
  std::size_t poses = 0;
};

Candidate candidate_at(const Trajectory& truth, const Trajectory& estimate, double offset_s) {
  const PosePairs pairs = pairs_at(truth, estimate, offset_s);
  Candidate candidate{.offset_s = offset_s, .poses = pairs.truth.size()};
  if (pairs.truth.empty()) return candidate;
  const auto S = align(pairs, Alignment::se3);
  if (!S) return candidate;
  double squares = 0.0;
  for (const Eigen::Vector3d& error : position_errors(pairs, *S)) squares += error.squaredNorm();
  candidate.rmse_m = std::sqrt(squares / static_cast<double>(pairs.truth.size()));
  return candidate;
}

Trajectory thinned(const Trajectory& trajectory) {
  const std::size_t step = trajectory.size() / kMostPoses + 1;
  Trajectory thin;
  for (std::size_t i = 0; i < trajectory.size(); i += step) thin.push_back(trajectory[i]);
  return thin;
}

Candidate scan(const Trajectory& truth, const Trajectory& estimate, double range_s) {
  std::vector<Candidate> candidates;
  std::size_t most_poses = 0;
  const int steps = static_cast<int>(std::ceil(range_s / kScanStepS));
  for (int i = -steps; i <= steps; ++i) {
    candidates.push_back(candidate_at(truth, estimate, i * kScanStepS));
    most_poses = std::max(most_poses, candidates.back().poses);
  }
  const double least_poses = kLeastOverlap * static_cast<double>(most_poses);
  Candidate best;
  for (const Candidate& candidate : candidates) {
    if (static_cast<double>(candidate.poses) >= least_poses && candidate.rmse_m < best.rmse_m) best = candidate;
  }
  return best;
}

}  // namespace

ClockOffset estimate_clock_offset(const Trajectory& truth, const Trajectory& estimate, double range_s) {
  const Trajectory thin = thinned(estimate);
  Candidate best = scan(truth, thin, range_s);
  if (!std::isfinite(best.rmse_m)) {
    throw Error("no clock offset can be found: truth and estimate do not overlap in time, or lie on a straight line");
  }
  for (double step_s = 0.5 * kScanStepS; step_s > 0.5 * kPrecisionS; step_s *= 0.5) {
    for (const double offset_s : {best.offset_s - step_s, best.offset_s + step_s}) {
      const Candidate candidate = candidate_at(truth, thin, offset_s);
      if (candidate.rmse_m < best.rmse_m) best = candidate;
    }
  }
  return {best.offset_s, best.rmse_m};
}

}  // namespace demslam

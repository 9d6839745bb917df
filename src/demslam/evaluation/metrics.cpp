#include "demslam/evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace demslam {
namespace {

double median_of(const std::vector<double>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

std::vector<IndexPair> pairs_by_index(std::size_t count, std::size_t delta, RpePairs kind) {
  std::vector<IndexPair> pairs;
  const std::size_t step = kind == RpePairs::all ? 1 : delta;
  for (std::size_t i = 0; i + delta < count; i += step) pairs.emplace_back(i, i + delta);
  return pairs;
}

/// Metres driven, or seconds passed, from each pose to the next.
std::vector<double> steps(const Trajectory& trajectory, DeltaUnit unit) {
  std::vector<double> values;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    const StampedPose &before = trajectory[i - 1], &now = trajectory[i];
    values.push_back(unit == DeltaUnit::metres ? (now.pose.translation() - before.pose.translation()).norm()
                                               : to_seconds(now.t_ns - before.t_ns));
  }
  return values;
}

/// evo begins the first pair where the first delta is complete, not at the first pose.
std::vector<IndexPair> consecutive_pairs(const std::vector<double>& steps, double delta) {
  std::vector<std::size_t> marks;
  double passed = 0.0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    passed += steps[i];
    if (passed < delta) continue;
    marks.push_back(i + 1);
    passed = 0.0;
  }
  std::vector<IndexPair> pairs;
  for (std::size_t i = 1; i < marks.size(); ++i) pairs.emplace_back(marks[i - 1], marks[i]);
  return pairs;
}

std::vector<IndexPair> all_pairs(const std::vector<double>& steps, double delta, double tolerance) {
  std::vector<double> passed(steps.size() + 1, 0.0);
  std::partial_sum(steps.begin(), steps.end(), passed.begin() + 1);
  std::vector<IndexPair> pairs;
  for (std::size_t i = 0; i + 1 < passed.size(); ++i) {
    const double target = passed[i] + delta;
    auto nearest = std::lower_bound(passed.begin() + static_cast<std::ptrdiff_t>(i) + 1, passed.end(), target);
    const bool step_back = nearest == passed.end() || (nearest - passed.begin() > static_cast<std::ptrdiff_t>(i) + 1 &&
                                                       target - *(nearest - 1) <= *nearest - target);
    if (step_back) --nearest;
    if (std::abs(*nearest - target) <= tolerance) pairs.emplace_back(i, nearest - passed.begin());
  }
  return pairs;
}

Pose relative_error(const PosePairs& pairs, const IndexPair& index) {
  const auto [i, j] = index;
  const Pose truth = pairs.truth[i].pose.inverse() * pairs.truth[j].pose;
  const Pose estimate = pairs.estimate[i].pose.inverse() * pairs.estimate[j].pose;
  return truth.inverse() * estimate;
}

double angle_of(const Eigen::Quaterniond& q) { return 2.0 * std::atan2(q.vec().norm(), std::abs(q.w())); }

double distance(const Trajectory& trajectory, const IndexPair& index) {
  return (trajectory[index.second].pose.translation() - trajectory[index.first].pose.translation()).norm();
}

template <class Error>
std::vector<double> each(const std::vector<IndexPair>& indices, const Error& error) {
  std::vector<double> errors(indices.size());
  std::transform(indices.begin(), indices.end(), errors.begin(), error);
  return errors;
}

}  // namespace

ErrorStatistics statistics(std::vector<double> errors) {
  const double n = static_cast<double>(errors.size());
  ErrorStatistics result{.count = errors.size()};
  std::sort(errors.begin(), errors.end());
  result.min = errors.front();
  result.max = errors.back();
  result.median = median_of(errors);
  result.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n;
  double squares = 0.0, deviations = 0.0;
  for (const double error : errors) {
    squares += error * error;
    deviations += (error - result.mean) * (error - result.mean);
  }
  result.rmse = std::sqrt(squares / n);
  result.std = std::sqrt(deviations / n);
  return result;
}

std::vector<Eigen::Vector3d> position_errors(const PosePairs& pairs, const Similarity& S) {
  std::vector<Eigen::Vector3d> errors;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    errors.push_back(S * pairs.estimate[i].pose.translation() - pairs.truth[i].pose.translation());
  }
  return errors;
}

std::vector<IndexPair> delta_pairs(const Trajectory& estimate, const RpeOptions& options) {
  if (options.unit == DeltaUnit::frames) {
    return pairs_by_index(estimate.size(), static_cast<std::size_t>(options.delta), options.pairs);
  }
  const std::vector<double> along = steps(estimate, options.unit);
  return options.pairs == RpePairs::all ? all_pairs(along, options.delta, options.delta * options.relative_tolerance)
                                        : consecutive_pairs(along, options.delta);
}

std::vector<double> relative_translation_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices) {
  return each(indices, [&](const IndexPair& index) { return relative_error(pairs, index).translation().norm(); });
}

std::vector<double> relative_rotation_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices) {
  return each(indices, [&](const IndexPair& index) { return angle_of(relative_error(pairs, index).rotation()); });
}

std::vector<double> relative_distance_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices) {
  return each(indices, [&](const IndexPair& index) {
    return std::abs(distance(pairs.truth, index) - distance(pairs.estimate, index));
  });
}

}  // namespace demslam

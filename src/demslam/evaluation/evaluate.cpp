#include "demslam/evaluation/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/evaluation/trajectory_io.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;
using Errors = std::vector<Eigen::Vector3d>;

/// An estimate's interval above this many medians is a gap: nothing was tracked there.
constexpr double kGapMedians = 3.0;

template <class Part>
ErrorStatistics statistics_of(const Errors& errors, const Part& part) {
  std::vector<double> values(errors.size());
  std::transform(errors.begin(), errors.end(), values.begin(), part);
  return statistics(std::move(values));
}

ErrorStatistics lengths(const Errors& errors) {
  return statistics_of(errors, [](const Eigen::Vector3d& error) { return error.norm(); });
}

std::string undetermined(Alignment alignment) {
  const std::string reason = alignment == Alignment::first_pose
                                 ? "the truth has positions only, no orientation to align the first pose with"
                                 : "the positions lie on one line or in one place, which leaves the rotation open";
  return std::string(title_of(alignment)) + " is not determined: " + reason;
}

std::optional<ErrorStatistics> ate_with(const PosePairs& pairs, Alignment alignment, Evaluation& evaluation) {
  const auto S = align(pairs, alignment);
  if (!S) {
    evaluation.notes.push_back(undetermined(alignment));
    return std::nullopt;
  }
  if (alignment == Alignment::sim3) evaluation.sim3_scale = S->scale;
  return lengths(position_errors(pairs, *S));
}

/// Distance along the truth, at its own rate, from its first paired pose to each paired pose.
std::vector<double> distances_along(const Trajectory& truth, const Trajectory& paired) {
  std::vector<double> distances;
  double distance_m = 0.0;
  auto at =
      std::find_if(truth.begin(), truth.end(), [&](const auto& pose) { return pose.t_ns >= paired.front().t_ns; });
  for (const StampedPose& pose : paired) {
    for (; at->t_ns < pose.t_ns; ++at) {
      distance_m += ((at + 1)->pose.translation() - at->pose.translation()).norm();
    }
    distances.push_back(distance_m);
  }
  return distances;
}

void evaluate_absolute(const Trajectory& truth, const PosePairs& pairs, Evaluation& evaluation) {
  const auto S = align(pairs, evaluation.alignment);
  if (!S) throw Error(undetermined(evaluation.alignment));
  const Errors errors = position_errors(pairs, *S);
  const std::vector<double> distances = distances_along(truth, pairs.truth);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    evaluation.errors.push_back({pairs.estimate[i].t_ns, distances[i], errors[i]});
  }
  evaluation.ate = lengths(errors);
  evaluation.ate_horizontal = statistics_of(errors, [](const Eigen::Vector3d& e) { return e.head<2>().norm(); });
  evaluation.ate_vertical = statistics_of(errors, [](const Eigen::Vector3d& e) { return std::abs(e.z()); });
  evaluation.path_length_m = distances.back();
  const double per_metre = distances.back() > 0.0 ? 1.0 / distances.back() : std::numeric_limits<double>::quiet_NaN();
  evaluation.ate_star = evaluation.ate.rmse * per_metre;
  evaluation.drift_percent = 100.0 * errors.back().norm() * per_metre;
}

std::vector<double> in_degrees(std::vector<double> angles_rad) {
  for (double& angle : angles_rad) angle *= 180.0 / std::numbers::pi;
  return angles_rad;
}

void evaluate_relative(const PosePairs& pairs, Evaluation& evaluation) {
  const auto indices = delta_pairs(pairs.estimate, evaluation.rpe_options);
  if (indices.empty()) {
    evaluation.notes.push_back("RPE " + describe(evaluation.rpe_options) +
                               ": the trajectory is too short for one pair");
  } else if (has_rotation(pairs.truth)) {
    evaluation.rpe = statistics(relative_translation_errors(pairs, indices));
    evaluation.rpe_rotation_deg = statistics(in_degrees(relative_rotation_errors(pairs, indices)));
  } else {
    evaluation.rpe = statistics(relative_distance_errors(pairs, indices));
    evaluation.notes.push_back(
        "RPE rotation is refused: the truth has positions only, its quaternions are placeholders; RPE translation "
        "compares "
        "the distances between the two positions of a pair instead (evo: point distance)");
  }
}

double median_interval_ns(const Trajectory& trajectory) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    intervals.push_back(static_cast<double>(trajectory[i].t_ns - trajectory[i - 1].t_ns));
  }
  return intervals.empty() ? 0.0 : statistics(std::move(intervals)).median;
}

double share_of_time(const Trajectory& truth, const Trajectory& estimate, TimestampNs offset_ns) {
  const TimestampNs begin_ns = truth.front().t_ns, end_ns = truth.back().t_ns;
  if (begin_ns == end_ns) return 1.0;
  const double longest_ns = kGapMedians * median_interval_ns(estimate);
  TimestampNs covered_ns = 0;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const TimestampNs from_ns = estimate[i - 1].t_ns, to_ns = estimate[i].t_ns;
    if (static_cast<double>(to_ns - from_ns) > longest_ns) continue;
    covered_ns +=
        std::max<TimestampNs>(0, std::min(to_ns + offset_ns, end_ns) - std::max(from_ns + offset_ns, begin_ns));
  }
  return static_cast<double>(covered_ns) / static_cast<double>(end_ns - begin_ns);
}

double share_of_frames(const std::vector<TimestampNs>& frames, const Trajectory& estimate) {
  const auto posed = std::count_if(estimate.begin(), estimate.end(), [&](const StampedPose& pose) {
    return std::binary_search(frames.begin(), frames.end(), pose.t_ns);
  });
  return static_cast<double>(posed) / static_cast<double>(frames.size());
}

double completion_of(const Trajectory& truth, const Trajectory& estimate, const EvaluationOptions& options) {
  if (!options.frame_stamps.empty()) return share_of_frames(options.frame_stamps, estimate);
  if (options.association.by_index) return 1.0;
  return share_of_time(truth, estimate, std::llround(options.association.offset_s * 1e9));
}

Json rmse_or_null(const std::optional<ErrorStatistics>& statistics) {
  return statistics ? Json(statistics->rmse) : Json(nullptr);
}

Json json_of(const std::optional<ErrorStatistics>& statistics) {
  if (!statistics) return nullptr;
  const ErrorStatistics& s = *statistics;
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std},
          {"min", s.min},   {"max", s.max},   {"count", s.count}};
}

void add_nees(const NeesMean& nees, const std::string& prefix, Json& json) {
  json[prefix + "_mean"] = nees.mean;
  json[prefix + "_lower_95"] = nees.lower_95;
  json[prefix + "_upper_95"] = nees.upper_95;
  json[prefix + "_effective_poses"] = nees.effective_poses;
}

void add_nees(const Nees& nees, Json& json) {
  add_nees(nees.position, "nees", json);
  add_nees(nees.horizontal, "nees_horizontal", json);
  add_nees(nees.vertical, "nees_vertical", json);
  json["nees_poses"] = nees.per_pose.size();
  json["nees_per_keyframe"] = nees.per_pose;
}

}  // namespace

Evaluation evaluate(const Trajectory& truth, const Trajectory& estimate, const EvaluationOptions& options) {
  const PosePairs pairs = associate(truth, estimate, options.association);
  Evaluation evaluation{.alignment = options.alignment, .rpe_options = options.rpe, .poses = pairs.truth.size()};
  evaluation.clock_offset_s = options.association.offset_s;
  evaluate_absolute(truth, pairs, evaluation);
  evaluation.ate_unaligned = ate_with(pairs, Alignment::none, evaluation);
  evaluation.ate_first_pose = ate_with(pairs, Alignment::first_pose, evaluation);
  evaluation.ate_se3 = ate_with(pairs, Alignment::se3, evaluation);
  evaluation.ate_sim3 = ate_with(pairs, Alignment::sim3, evaluation);
  evaluate_relative(pairs, evaluation);
  evaluation.completion = completion_of(truth, estimate, options);
  return evaluation;
}

std::string describe(const RpeOptions& options) {
  const char* unit = options.unit == DeltaUnit::metres ? " m" : options.unit == DeltaUnit::seconds ? " s" : " frame";
  const bool plural = options.unit == DeltaUnit::frames && options.delta != 1.0;
  return fmt::format("over {:g}{}{}, {} pairs", options.delta, unit, plural ? "s" : "",
                     options.pairs == RpePairs::all ? "all" : "consecutive");
}

std::string evaluation_json(const Evaluation& e) {
  Json json = {{"alignment", name_of(e.alignment)},
               {"poses", e.poses},
               {"clock_offset_s", e.clock_offset_s},
               {"path_length_m", e.path_length_m},
               {"completion", e.completion},
               {"ate_rmse_m", e.ate.rmse},
               {"ate_horizontal_rmse_m", e.ate_horizontal.rmse},
               {"ate_vertical_rmse_m", e.ate_vertical.rmse},
               {"ate_star", e.ate_star},
               {"drift_percent", e.drift_percent},
               {"ate_unaligned_rmse_m", rmse_or_null(e.ate_unaligned)},
               {"ate_first_pose_rmse_m", rmse_or_null(e.ate_first_pose)},
               {"ate_se3_rmse_m", rmse_or_null(e.ate_se3)},
               {"ate_sim3_rmse_m", rmse_or_null(e.ate_sim3)},
               {"sim3_scale", e.sim3_scale ? Json(*e.sim3_scale) : Json(nullptr)},
               {"rpe", describe(e.rpe_options)},
               {"rpe_rmse_m", rmse_or_null(e.rpe)},
               {"rpe_rotation_rmse_deg", rmse_or_null(e.rpe_rotation_deg)},
               {"ate_m", json_of(e.ate)},
               {"rpe_m", json_of(e.rpe)},
               {"rpe_rotation_deg", json_of(e.rpe_rotation_deg)},
               {"notes", e.notes}};
  if (e.nees) add_nees(*e.nees, json);
  return json.dump(1) + "\n";
}

}  // namespace demslam

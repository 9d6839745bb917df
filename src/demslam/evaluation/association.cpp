#include "demslam/evaluation/association.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

TimestampNs to_ns(double seconds) { return std::llround(seconds * 1e9); }

/// The pose nearest in time, the earlier of two that are equally near.
std::size_t nearest(const Trajectory& trajectory, TimestampNs t_ns) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), t_ns,
                                      [](const StampedPose& pose, TimestampNs t) { return pose.t_ns < t; });
  if (after == trajectory.begin()) return 0;
  const auto before = after - 1;
  const bool take_after = after != trajectory.end() && after->t_ns - t_ns < t_ns - before->t_ns;
  return static_cast<std::size_t>((take_after ? after : before) - trajectory.begin());
}

std::string span_text(const Trajectory& trajectory) {
  return seconds_text(trajectory.front().t_ns) + " to " + seconds_text(trajectory.back().t_ns) + " s";
}

PosePairs pair_by_index(const Trajectory& truth, const Trajectory& estimate) {
  if (truth.size() != estimate.size()) {
    throw Error("the truth has " + std::to_string(truth.size()) + " poses and the estimate " +
                std::to_string(estimate.size()) + "; without stamps (KITTI) they must be equally many");
  }
  return {truth, estimate};
}

}  // namespace

PosePairs associate(const Trajectory& truth, const Trajectory& estimate, const AssociationOptions& options) {
  if (truth.empty() || estimate.empty()) throw Error("a trajectory without poses cannot be evaluated");
  if (options.by_index) return pair_by_index(truth, estimate);
  const bool estimate_is_longer = estimate.size() > truth.size();
  const Trajectory &longer = estimate_is_longer ? estimate : truth, &shorter = estimate_is_longer ? truth : estimate;
  const TimestampNs max_difference_ns = to_ns(options.max_difference_s);
  const TimestampNs shift_ns = to_ns(options.offset_s) * (estimate_is_longer ? -1 : 1);
  PosePairs pairs;
  for (const StampedPose& pose : shorter) {
    const TimestampNs t_ns = pose.t_ns + shift_ns;
    const StampedPose& match = longer[nearest(longer, t_ns)];
    if (std::abs(match.t_ns - t_ns) > max_difference_ns) continue;
    pairs.truth.push_back(estimate_is_longer ? pose : match);
    pairs.estimate.push_back(estimate_is_longer ? match : pose);
  }
  if (pairs.truth.empty()) {
    throw Error("no pose of the estimate (" + span_text(estimate) + ") is within " +
                std::to_string(options.max_difference_s) + " s of one of the truth (" + span_text(truth) +
                "); check the files, or give a time offset");
  }
  return pairs;
}

}  // namespace demslam

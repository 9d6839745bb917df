#pragma once

#include "demslam/geometry/trajectory.h"

namespace demslam {

struct AssociationOptions {
  double max_difference_s = 0.01;  ///< evo's default
  double offset_s = 0.0;           ///< added to the estimate's stamps
  bool by_index = false;           ///< pose i belongs to pose i; the counts must agree (KITTI files carry no stamps)
};

/// Poses that belong together: truth[i] and estimate[i]. Each side keeps its own stamps.
struct PosePairs {
  Trajectory truth, estimate;
};

/// Pairs by the nearest stamp as evo does: for each pose of the shorter trajectory (the estimate, when they are equally
/// long) the nearest in time of the longer one, kept if the difference is at most `max_difference_s`. Throws Error when
/// nothing pairs, or the counts differ where `by_index` is set.
PosePairs associate(const Trajectory& truth, const Trajectory& estimate, const AssociationOptions& options = {});

}  // namespace demslam

#pragma once

#include <vector>

#include "demslam/base/time.h"
#include "demslam/geometry/pose.h"

namespace demslam {

/// A pose at a time. Which two frames the pose joins is said by whoever holds it.
struct StampedPose {
  TimestampNs t_ns = 0;
  Pose pose;
};

/// Poses in increasing time.
using Trajectory = std::vector<StampedPose>;

/// Sum of the distances between successive positions, metres.
double path_length_m(const Trajectory& trajectory);

}  // namespace demslam

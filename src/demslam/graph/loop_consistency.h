#pragma once

#include "demslam/graph/pose_graph.h"

namespace demslam {

/// Chi-square distance (6 degrees of freedom) of two loops from each other: the second one as it follows from the first
/// and the odometry between their keyframes, both loops' covariances and the odometry's included. Infinite where the
/// odometry is broken between them.
double loops_apart(const PoseGraph& graph, const RelativePose& first, const RelativePose& second);

}  // namespace demslam

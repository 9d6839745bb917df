#pragma once

#include <gtsam/inference/Ordering.h>
#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>

namespace demslam {

/// Order of elimination by nested dissection (METIS): the same for the same graph, whatever other threads do. METIS
/// draws from one random generator of the whole process, so threads wait for each other here.
gtsam::Ordering nested_dissection(const gtsam::NonlinearFactorGraph& graph);
gtsam::Ordering nested_dissection(const gtsam::GaussianFactorGraph& graph);

}  // namespace demslam

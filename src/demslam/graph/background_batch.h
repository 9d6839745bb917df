#pragma once

#include <future>
#include <memory>

#include "demslam/graph/pose_graph_problem.h"

namespace demslam {

/// A batch over a copy of the graph, beside the run: on one thread, so that the run keeps the other processors.
class BackgroundBatch {
 public:
  /// What it comes to, for the graph as it was.
  struct Solution {
    gtsam::Values values;
    std::vector<Pose> poses;
    std::vector<bool> loops_on;
    CondensedPast past;  ///< up to where it ended in the copy
    OptimizerReport report;
  };

  /// Begins at once, or whenever `launch` thinks fit.
  BackgroundBatch(PoseGraphProblem copy, double relative_tolerance, const BatchLauncher& launch);

  std::size_t keyframes() const { return keyframes_; }  ///< of the copy
  double path_m() const { return path_m_; }             ///< of the copy
  /// Waits for it and takes it, once. Throws what the batch threw.
  Solution take();

 private:
  std::size_t keyframes_;
  double path_m_;
  std::shared_ptr<Solution> solution_;
  std::future<void> ready_;  ///< waits for its thread when it is destroyed
};

}  // namespace demslam

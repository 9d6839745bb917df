#pragma once

#include <optional>
#include <vector>

#include "demslam/graph/background_batch.h"
#include "demslam/graph/clique_covariance.h"
#include "demslam/graph/pose_graph_problem.h"

namespace demslam {

/// The problem, and what only the run needs.
struct PoseGraph::State : PoseGraphProblem {
  /// What was known of a keyframe when it was the newest: never less than what is known of it later.
  struct Known {
    std::size_t keyframe = 0;
    Matrix6d covariance;
  };

  BatchLauncher launch;
  std::vector<bool> tied;    ///< per keyframe: held by a prior, or by a relative pose to an earlier one
  std::vector<Known> known;  ///< in the order of their keyframes
  Matrix4d systematic_covariance = Matrix4d::Zero();
  std::size_t batches = 0, loops_waiting = 0, shared = 0;
  double path_at_batch_m = 0.0;
  std::optional<BackgroundBatch> under_way;

  void check_tied() const;
  std::size_t stretch_after(std::size_t keyframe);  ///< of the motion that leaves it; makes one where a stretch ends

  // Batches in the run.
  bool batch_is_due() const;
  void begin_batch();
  OptimizerReport adopt_batch();  ///< waits for it
  void adopt(BackgroundBatch::Solution solution);
  void take_over(gtsam::Values& solution);
  OptimizerReport solve_window();  ///< everything after the past

  // Covariance.
  gtsam::GaussianBayesTree::shared_ptr linearized() const;  ///< everything, at the present estimate, eliminated
  void note_newest();
  std::optional<Matrix6d> known_covariance(std::size_t keyframe) const;
};

}  // namespace demslam

#pragma once

#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <memory>
#include <vector>

#include "demslam/graph/condensed_past.h"
#include "demslam/graph/factor_table.h"
#include "demslam/graph/odometry_chain.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

gtsam::Key systematic_key(std::size_t stretch);

/// All that a solution reads and moves: variables, factors, loops. A copy can be solved in another thread: it shares
/// with the original only what neither of them changes.
///
/// A keyframe that carries nothing but odometry is "folded" when it leaves the window: the two motions around it become
/// one, and its pose follows from its neighbours'. What is left in `values` and `factors` are the keyframes that carry
/// something (a prior, a DEM factor, a loop), and the window. A factor on a folded keyframe unfolds it.
struct PoseGraphProblem {
  struct Loop {
    std::shared_ptr<const std::vector<RelativePose>> measurements;
    std::vector<FactorTable::Factor> factors;  ///< none while switched off

    bool is_on() const { return !factors.empty(); }
  };

  PoseGraphOptions options;
  FactorTable factors;
  gtsam::Values values;
  std::vector<Pose> poses;
  std::vector<std::size_t> stretch_of;  ///< per keyframe: which systematic state its odometry has
  std::vector<bool> held;               ///< per keyframe: a factor other than the chain's odometry speaks of it
  std::vector<bool> folded;
  OdometryChain chain;
  std::vector<Loop> loops;
  CondensedPast past;
  std::size_t stretches = 0, folded_until = 1;

  void add(const FactorTable::Factor& factor);
  gtsam::NonlinearFactorGraph factor_graph() const;  ///< what the past says, and the factors of everything after it
  static constexpr double kConverged = 1e-6;         ///< relative decrease of the error that ends a solution
  OptimizerReport solve(int max_iterations, double relative_tolerance = kConverged);
  OptimizerReport solve_all(double relative_tolerance);  ///< without a past, and the loops sorted out
  void move_to(const gtsam::Values& solution);
  Vector4d systematic(std::size_t stretch) const;

  // Folding.
  FactorTable::Factor link(std::size_t a, std::size_t b) const;  ///< the odometry from a to b as one factor
  bool foldable(std::size_t keyframe) const;
  void fold_until(std::size_t end);
  void unfold(std::size_t keyframe);
  std::size_t held_before(std::size_t keyframe) const;  ///< the nearest unfolded one, itself excluded
  std::size_t held_after(std::size_t keyframe) const;
  void place_folded(std::size_t begin);  ///< from this unfolded keyframe on

  // Loops.
  double misfit(const Loop& loop) const;  ///< mean chi-square by the measurements' covariances alone
  void weigh(Loop& loop, double weight);  ///< 0 takes it out
  /// Switches loops off and on again. Expects everything to be solved; true: it is to be solved again.
  bool sort_out_loops();
  std::vector<bool> loops_on() const;
  bool loops_fit() const;  ///< each within the gate, or switched off and beyond it
  void graduate();         ///< graduated non-convexity over all loops: for gross contradictions
  /// Baarda's data snooping, for what hides in a loose graph: the loop that the rest believes least is left out, until
  /// the rest believes all; then those left out that it believes come back, once. True when any changed sides.
  bool snoop();
  /// Chi-square (6 degrees of freedom) of every loop's displacement as a whole against everything else: one pass down
  /// the Bayes tree, exact where the graph is linear.
  std::vector<double> against_the_rest() const;
  /// options.loop_gate, wider where most loops contradict the stated covariances: by the variance of unit weight, from
  /// their median.
  double gate_of(const std::vector<double>& chi_squares) const;
  bool leave_out_the_worst(const std::vector<double>& chi_squares);
  bool take_back(const std::vector<double>& chi_squares);
};

}  // namespace demslam

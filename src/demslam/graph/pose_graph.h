#pragma once

#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <memory>
#include <vector>

#include "demslam/geometry/pose.h"

namespace gtsam {
class NonlinearFactor;
}

namespace demslam {

/// Relative-pose measurement between two keyframes, with the covariance of its right perturbation (rotation,
/// translation).
struct RelativePose {
  std::size_t i = 0, j = 0;
  Pose T_i_j;
  Matrix6d covariance = Matrix6d::Identity();
};

/// Systematic errors of the odometry as states: one per stretch of path, a random walk from stretch to stretch.
struct SystematicOptions {
  bool enabled = false;
  double scale_sigma = 0.01;                ///< prior of the relative scale error
  double rotation_sigma_deg_per_m = 0.001;  ///< prior of the rotation bias, per body axis
  double stretch_m = 200.0;                 ///< length of path that shares one state
  double scale_walk_per_sqrt_km = 0.002;    ///< growth of the scale's uncertainty along the path
  double rotation_walk_deg_per_m_per_sqrt_km = 0.0003;
};

/// The graph's estimate of the systematic errors where a keyframe is.
struct SystematicErrors {
  double scale = 0.0;                                            ///< true length / measured length = exp(scale)
  Eigen::Vector3d rotation_rad_per_m = Eigen::Vector3d::Zero();  ///< body axes
};

struct PoseGraphOptions {
  SystematicOptions systematic;
  double loop_kernel_sigmas = 3.0;  ///< Cauchy width of loop closures, on the norm of the whitened six-vector
  int max_iterations = 100;
};

struct OptimizerReport {
  double error_before = 0.0, error_after = 0.0;
  int iterations = 0;
  std::size_t factors = 0;  ///< in the problem solved
  double milliseconds = 0.0;
};

/// Keyframe poses T_map_body and the factors between and on them; Levenberg-Marquardt in batch (GTSAM, METIS ordering).
/// Loop and unary factors carry robust kernels of their own; a factor knows its keyframes by index (gtsam::Key ==
/// index). Same calls, same bytes, whatever the number of threads.
class PoseGraph {
 public:
  explicit PoseGraph(const PoseGraphOptions& options = {});
  ~PoseGraph();
  PoseGraph(PoseGraph&&) noexcept;

  /// Adds keyframe `size()` at an initial estimate and returns its index.
  std::size_t add_keyframe(const Pose& T_map_body);
  void add_prior(std::size_t keyframe, const Pose& T_map_body, const Matrix6d& covariance);
  void add_odometry(const RelativePose& measurement);
  void add_loop(const RelativePose& measurement);  ///< Cauchy kernel
  void add_factor(const boost::shared_ptr<gtsam::NonlinearFactor>& factor);

  /// All keyframes in batch. Throws Error when a keyframe is tied to nothing (no prior, no odometry).
  OptimizerReport optimize();
  /// Keyframes from `first` on, at a cost that depends on their number only: what is older is condensed, once, into a
  /// Gaussian on the window's boundary, and keeps its estimate. Factors added later to older keyframes (loop closures)
  /// wait for optimize(), which puts everything in play again. `first` may only grow between two calls of optimize().
  OptimizerReport optimize_window(std::size_t first);

  std::size_t size() const;
  std::size_t loops() const;
  const Pose& T_map_body(std::size_t keyframe) const;
  /// All zero when systematic states are off.
  SystematicErrors systematic_errors(std::size_t keyframe) const;
  /// The odometry's measurement with the present estimate of its systematic errors taken out.
  Pose corrected_odometry(const RelativePose& measurement) const;
  /// Marginal covariance of the right perturbation, for each asked keyframe, at the present estimate.
  std::vector<Matrix6d> covariances(const std::vector<std::size_t>& keyframes) const;
  /// The same for the newest keyframe, from the last window alone.
  Matrix6d newest_covariance() const;
  /// Covariance of the right perturbation of the graph's own T_i_j.
  Matrix6d relative_covariance(std::size_t i, std::size_t j) const;
  /// Chi-square distance (6 degrees of freedom) of a measurement from the graph's own prediction, both covariances
  /// included.
  double chi_square(const RelativePose& measurement) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam

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

/// Relative-pose measurement between two keyframes, with the covariance of its right perturbation (rotation, translation).
struct RelativePose {
  std::size_t i = 0, j = 0;
  Pose T_i_j;
  Matrix6d covariance = Matrix6d::Identity();
};

struct OptimizerReport {
  double error_before = 0.0, error_after = 0.0;
  int iterations = 0;
  double milliseconds = 0.0;
};

/// Keyframe poses T_map_body and the factors between and on them; Levenberg-Marquardt in batch (GTSAM, METIS ordering).
/// Loop and unary factors carry robust kernels of their own; a factor knows its keyframes by index (gtsam::Key == index).
class PoseGraph {
 public:
  PoseGraph();
  ~PoseGraph();
  PoseGraph(PoseGraph&&) noexcept;

  /// Adds keyframe `size()` at an initial estimate and returns its index.
  std::size_t add_keyframe(const Pose& T_map_body);
  void add_prior(std::size_t keyframe, const Pose& T_map_body, const Matrix6d& covariance);
  void add_odometry(const RelativePose& measurement);
  void add_loop(const RelativePose& measurement);  ///< Cauchy kernel
  void add_factor(const boost::shared_ptr<gtsam::NonlinearFactor>& factor);

  OptimizerReport optimize();

  std::size_t size() const;
  std::size_t loops() const;
  const Pose& T_map_body(std::size_t keyframe) const;
  /// Marginal covariance of the right perturbation, for each asked keyframe, at the present estimate.
  std::vector<Matrix6d> covariances(const std::vector<std::size_t>& keyframes) const;
  /// Chi-square distance (6 degrees of freedom) of a measurement from the graph's own prediction, both covariances included.
  double chi_square(const RelativePose& measurement) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam

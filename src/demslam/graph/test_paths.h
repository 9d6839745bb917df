#pragma once

#include <cmath>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/graph/pose_graph.h"

namespace demslam::test {

inline Matrix6d isotropic(double sigma_rad, double sigma_m) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(sigma_rad * sigma_rad), Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variance.asDiagonal();
}

inline const Matrix6d kTight = isotropic(1e-5, 1e-4), kOdometry = isotropic(0.002, 0.02),
                      kLoop = isotropic(0.001, 0.01);

inline Vector6d noise(Random& random, const Matrix6d& covariance) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = std::sqrt(covariance(i, i)) * random.normal();
  return xi;
}

/// A circle driven once, steps of about `step_m`, the last pose on the first.
inline std::vector<Pose> circle(std::size_t count, double step_m) {
  std::vector<Pose> poses{Pose()};
  Vector6d step = Vector6d::Zero();
  step[2] = 2.0 * M_PI / static_cast<double>(count - 1);
  step[3] = step_m;
  while (poses.size() < count) poses.push_back(poses.back() * Pose::exp(step));
  return poses;
}

inline RelativePose between(const std::vector<Pose>& truth, std::size_t i, std::size_t j, const Matrix6d& covariance,
                            Random& random) {
  return {i, j, truth[i].inverse() * truth[j] * Pose::exp(noise(random, covariance)), covariance};
}

/// Odometry around `truth`, dead-reckoned initial poses.
inline PoseGraph odometry_graph(const std::vector<Pose>& truth, std::uint64_t seed,
                                const PoseGraphOptions& options = {}) {
  Random random(seed);
  PoseGraph graph(options);
  graph.add_keyframe(truth[0]);
  graph.add_prior(0, truth[0], kTight);
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const RelativePose step = between(truth, k - 1, k, kOdometry, random);
    graph.add_keyframe(graph.T_map_body(k - 1) * step.T_i_j);
    graph.add_odometry(step);
  }
  return graph;
}

}  // namespace demslam::test

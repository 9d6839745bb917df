#pragma once

#include <Eigen/Eigenvalues>
#include <cmath>

#include "demslam/geometry/pose.h"

namespace demslam {

/// What the covariance of a pose's right perturbation (rotation, translation; body axes) says in the frame that the
/// pose leads to.
inline Eigen::Matrix3d position_covariance(const Pose& T_map_body, const Matrix6d& covariance) {
  const Eigen::Matrix3d R = T_map_body.rotation_matrix();
  return R * covariance.bottomRightCorner<3, 3>() * R.transpose();
}

/// Metres, in the horizontal direction that is known worst.
inline double horizontal_sigma_m(const Pose& T_map_body, const Matrix6d& covariance) {
  const Eigen::Matrix2d horizontal = position_covariance(T_map_body, covariance).topLeftCorner<2, 2>();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(horizontal).eigenvalues().maxCoeff());
}

/// Radians, about the vertical.
inline double heading_sigma_rad(const Pose& T_map_body, const Matrix6d& covariance) {
  const Eigen::Vector3d up = T_map_body.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return std::sqrt(up.dot(covariance.topLeftCorner<3, 3>() * up));
}

}  // namespace demslam

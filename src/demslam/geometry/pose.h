#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace demslam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rigid transform, named T_a_b where it maps points of frame b into frame a: p_a = T_a_b * p_b.
/// Perturbed on the right, T * Exp(xi), xi = (omega, v), rotation first (docs/conventions.md).
class Pose {
 public:
  Pose() = default;  ///< identity
  Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : Pose(Eigen::Quaterniond(rotation), translation) {}

  /// From numbers that were a pose's: bit for bit, without the constructor's normalisation.
  static Pose exactly(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    Pose pose;
    pose.rotation_ = rotation;
    pose.translation_ = translation;
    return pose;
  }

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotation_matrix() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  Pose inverse() const;
  Pose operator*(const Pose& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation_ * point + translation_; }

  /// The full SE(3) exponential and logarithm, angles below pi.
  static Pose exp(const Vector6d& xi);
  Vector6d log() const;

  /// Ad_T: xi_a = Ad(T_a_b) * xi_b; moves a right perturbation (or, both sides, a covariance) between frames.
  Matrix6d adjoint() const;

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation that turns about +z by yaw, then the new +y by pitch, then the new +x by roll (Rz * Ry * Rx), radians.
/// In the body frame (forward, left, up) a positive pitch lowers the nose.
Eigen::Quaterniond rotation_from_rpy(double roll, double pitch, double yaw);

/// Heading: the angle of the body's forward axis in the map's x-y plane, from +x (East) to +y (North), radians.
double yaw_of(const Eigen::Quaterniond& R_map_body);

/// Body axes (forward, left, up) from camera axes (right, down, forward): the rotation of a level, forward-looking
/// camera.
Eigen::Quaterniond R_body_camera_level();

}  // namespace demslam

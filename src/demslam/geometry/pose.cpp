#include "demslam/geometry/pose.h"

#include <cmath>

namespace demslam {
namespace {

/// Left Jacobian of SO(3), V(omega), and its inverse (Barfoot, State Estimation for Robotics, eq. 7.77).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& omega) {
  const double angle2 = omega.squaredNorm();
  const Eigen::Matrix3d W = skew(omega);
  if (angle2 < 1e-10) return Eigen::Matrix3d::Identity() + 0.5 * W + W * W / 6.0;
  const double angle = std::sqrt(angle2);
  return Eigen::Matrix3d::Identity() + (1.0 - std::cos(angle)) / angle2 * W +
         (angle - std::sin(angle)) / (angle2 * angle) * W * W;
}

Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& omega) {
  const double angle2 = omega.squaredNorm();
  const Eigen::Matrix3d W = skew(omega);
  if (angle2 < 1e-10) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 12.0;
  const double angle = std::sqrt(angle2);
  const double half = 0.5 * angle;
  return Eigen::Matrix3d::Identity() - 0.5 * W + (1.0 - half * std::cos(half) / std::sin(half)) / angle2 * W * W;
}

Eigen::Vector3d rotation_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double norm = q.vec().norm();
  if (norm < 1e-12) return 2.0 * sign * q.vec();
  return sign * q.vec() * (2.0 * std::atan2(norm, sign * q.w()) / norm);
}

Eigen::Quaterniond rotation_exp(const Eigen::Vector3d& omega) {
  const double angle = omega.norm();
  const double scale = angle < 1e-8 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = scale * omega;
  return q;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_matrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse = rotation_.conjugate();
  return Pose(inverse, -(inverse * translation_));
}

Pose Pose::operator*(const Pose& other) const {
  return Pose(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_);
}

Pose Pose::exp(const Vector6d& xi) {
  const Eigen::Vector3d omega = xi.head<3>();
  return Pose(rotation_exp(omega), left_jacobian(omega) * xi.tail<3>());
}

Vector6d Pose::log() const {
  Vector6d xi;
  xi.head<3>() = rotation_log(rotation_);
  xi.tail<3>() = left_jacobian_inverse(xi.head<3>()) * translation_;
  return xi;
}

Matrix6d Pose::adjoint() const {
  const Eigen::Matrix3d R = rotation_matrix();
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = R;
  ad.bottomRightCorner<3, 3>() = R;
  ad.bottomLeftCorner<3, 3>() = skew(translation_) * R;
  return ad;
}

Eigen::Quaterniond rotation_from_rpy(double roll, double pitch, double yaw) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
         AngleAxisd(roll, Vector3d::UnitX());
}

double yaw_of(const Eigen::Quaterniond& R_map_body) {
  const Eigen::Vector3d forward = R_map_body * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

Eigen::Quaterniond R_body_camera_level() {
  Eigen::Matrix3d R;  // columns: the camera's right, down, forward axes in the body
  R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return Eigen::Quaterniond(R);
}

}  // namespace demslam

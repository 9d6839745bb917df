#pragma once

#include <Eigen/Core>

#include "demslam/geometry/camera.h"
#include "demslam/geometry/pose.h"

namespace demslam {

/// A stereo measurement (u, v, d): left pixel and disparity, whose errors are independent, unlike those of (u_l, v,
/// u_r). d = 0 where there is no disparity.
using StereoPixel = Eigen::Vector3d;

inline bool has_disparity(const StereoPixel& pixel) { return pixel.z() > 0.0; }

inline Eigen::Vector3d unproject(const RectifiedRig& rig, const StereoPixel& pixel) {
  return rig.unproject(pixel.head<2>(), pixel.z());
}

/// (u, v, d) of a point in the left camera's frame; z must be positive.
inline StereoPixel project(const RectifiedRig& rig, const Eigen::Vector3d& p_left) {
  const Eigen::Vector2d pixel = rig.project(p_left);
  return {pixel.x(), pixel.y(), rig.disparity_px(p_left.z()) + rig.vergence_px()};
}

/// d(u, v, d) / dp of `project`.
inline Eigen::Matrix3d projection_jacobian(const RectifiedRig& rig, const Eigen::Vector3d& p_left) {
  const double a = rig.focal_px / p_left.z(), b = a / p_left.z();
  Eigen::Matrix3d J;
  J << a, 0.0, -b * p_left.x(), 0.0, a, -b * p_left.y(), 0.0, 0.0, -b * rig.baseline_m;
  return J;
}

/// dp / d(u, v, d) of `unproject`.
inline Eigen::Matrix3d unprojection_jacobian(const RectifiedRig& rig, const StereoPixel& pixel) {
  const Eigen::Vector3d p_left = unproject(rig, pixel);
  const double pixel_size = p_left.z() / rig.focal_px;  // metres at the point's depth
  const Eigen::Vector3d by_parallax = -p_left / rig.parallax_px(pixel.z());
  Eigen::Matrix3d J;
  J << pixel_size, 0.0, by_parallax.x(), 0.0, pixel_size, by_parallax.y(), 0.0, 0.0, by_parallax.z();
  return J;
}

/// dp_b / dxi for p_b = (T_a_b Exp(xi))^-1 p_a.
inline Eigen::Matrix<double, 3, 6> point_jacobian(const Eigen::Vector3d& p_b) {
  Eigen::Matrix<double, 3, 6> J;
  J << skew(p_b), -Eigen::Matrix3d::Identity();
  return J;
}

}  // namespace demslam

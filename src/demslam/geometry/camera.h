#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <string>

#include "demslam/geometry/pose.h"

namespace demslam {

enum class Distortion {
  none,
  radtan,       ///< Brown-Conrady k1, k2, p1, p2, k3 (OpenCV order)
  equidistant,  ///< Kannala-Brandt fisheye k1..k4
};

/// Pinhole camera with lens distortion. The centre of the top-left pixel is (0, 0).
struct Camera {
  int width = 0, height = 0;                      ///< pixels
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< pixels
  Distortion distortion = Distortion::none;
  std::array<double, 5> coefficients{};  ///< meaning by `distortion`; unused ones are zero
};

/// A stereo pair as calibrated, before rectification, and where it sits on the rover.
struct StereoRig {
  Camera left, right;
  Pose T_left_right;                                        ///< right camera in the left camera's frame; metres
  Pose T_body_left;                                         ///< left camera in the body (forward, left, up)
  Eigen::Vector3d p_body_ground = Eigen::Vector3d::Zero();  ///< ground contact point in the body, metres
};

/// An ideal rectified pair: same intrinsics, rows aligned, right camera at +baseline along the left one's x axis.
struct RectifiedRig {
  int width = 0, height = 0;  ///< pixels
  double focal_px = 0.0, cx = 0.0, cy = 0.0;
  double baseline_m = 0.0;
  Pose T_body_left;  ///< the rectified left camera in the body
  Eigen::Vector3d p_body_ground = Eigen::Vector3d::Zero();
  /// Turn of the right camera about its y axis since the calibration: it adds f vergence to every disparity. (And f
  /// vergence x^2, which is left out: a shifted principal point, of which it is made up as often, has no such part.)
  double vergence_rad = 0.0;

  /// Pixel (u, v) of the left image of a point in the left camera's frame; z must be positive.
  Eigen::Vector2d project(const Eigen::Vector3d& p_left) const {
    return {focal_px * p_left.x() / p_left.z() + cx, focal_px * p_left.y() / p_left.z() + cy};
  }
  /// f B / Z: of d = u_left - u_right what the distance makes, which is all of it without vergence.
  double disparity_px(double depth_m) const { return focal_px * baseline_m / depth_m; }
  double depth_m(double disparity_px) const { return focal_px * baseline_m / disparity_px; }
  /// What the vergence adds to it.
  double vergence_px() const { return focal_px * vergence_rad; }
  /// A measured disparity without that, kept positive.
  double parallax_px(double measured_px) const {
    constexpr double kLeastPx = 1e-3;
    return std::max(kLeastPx, measured_px - vergence_px());
  }
  /// Point in the left camera's frame of pixel (u, v) with a measured disparity > 0.
  Eigen::Vector3d unproject(const Eigen::Vector2d& pixel, double disparity_px) const {
    const double z = depth_m(parallax_px(disparity_px));
    return {(pixel.x() - cx) * z / focal_px, (pixel.y() - cy) * z / focal_px, z};
  }
};

/// Throws Error with the reason when a calibration cannot be real (zero or NaN focal length or baseline, principal
/// point far outside, sizes that differ); `source` names the file in the message.
void check_rig(const StereoRig& rig, const std::string& source);

}  // namespace demslam

#pragma once

#include <optional>
#include <vector>

#include "demslam/odometry/stereo_geometry.h"

namespace demslam {

/// One point of the scene seen from two stereo views. View a always has a disparity.
struct Correspondence {
  StereoPixel a, b;
  std::optional<Eigen::Matrix3d> covariance_b;  ///< of (u, v, d); none: b is a keypoint, as noisy as StereoNoise says
};

/// Standard deviations of (u, v, d) in both views. Where b was found by aligning a's patch, a's own pixel is exact by
/// definition: all the error of the alignment is b's, and b brings its own covariance.
/// A far point's small disparity is no more than a hint, for errors of the calibration bias all of them alike: what
/// counts is its direction.
struct StereoNoise {
  Eigen::Vector3d a, b;
  double far_disparity_px = 0.0;  ///< below this a point is far
  double far_sigma_px = 1.0;      ///< standard deviation of its disparity

  Eigen::Matrix3d covariance_a(const StereoPixel& pixel) const { return held_far(pixel, a.cwiseAbs2().asDiagonal()); }
  Eigen::Matrix3d covariance_b(const StereoPixel& pixel, const std::optional<Eigen::Matrix3d>& own) const {
    return held_far(pixel, own ? *own : Eigen::Matrix3d(b.cwiseAbs2().asDiagonal()));
  }

 private:
  Eigen::Matrix3d held_far(const StereoPixel& pixel, Eigen::Matrix3d covariance) const {
    if (pixel.z() < far_disparity_px) covariance(2, 2) = far_sigma_px * far_sigma_px;
    return covariance;
  }
};

}  // namespace demslam

#pragma once

#include <vector>

#include "demslam/odometry/stereo_geometry.h"

namespace demslam {

/// One point of the scene seen from two stereo views. View a always has a disparity.
struct Correspondence {
  StereoPixel a, b;
};

/// Standard deviations of (u, v, d) in both views. Where b was found by aligning a's patch, a's own pixel is exact by
/// definition: all the error of the alignment is b's.
struct StereoNoise {
  Eigen::Vector3d a, b;
};

}  // namespace demslam

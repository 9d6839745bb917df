#pragma once

#include <vector>

#include "demslam/odometry/stereo_geometry.h"

namespace demslam {

/// One point of the scene seen from two stereo views. View a always has a disparity.
struct Correspondence {
  StereoPixel a, b;
};

/// Standard deviations of a measurement (u, v, d).
struct StereoNoise {
  double pixel_px = 0.7;
  double disparity_px = 0.25;
};

}  // namespace demslam

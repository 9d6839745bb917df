#pragma once

#include <Eigen/Core>
#include <vector>

#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"

namespace demslam {

/// No disparity that is found is smaller: 0 stands for none.
inline constexpr float kLeastDisparityPx = 0.05F;

/// How the right image is searched for a left keypoint. The defaults suit images of 0.1 to 2 megapixels.
struct DisparityOptions {
  double min_disparity_px = -1.0;  ///< of points far away come out around zero; what is found is at least 0.05
  double max_disparity_px = 256.0;
  double uniqueness = 0.95;  ///< the best place must be this much better than any other, as a ratio of costs
  double left_right_tolerance_px = 1.5;
  double min_correlation = 0.8;  ///< of the refined patches
};

struct Disparities {
  std::vector<float> disparity_px;     ///< 0 where there is none to trust
  std::vector<Eigen::Vector2f> slope;  ///< d(disparity) / d(u, v) on the surface around the keypoint
};

/// Disparity of each left keypoint, found by correlation along the right image's row (the right image needs no
/// features), checked back from right to left, then refined below the pixel by aligning the patches with shift, shear
/// and brightness free (the ground in front of a rover is no fronto-parallel plane).
Disparities find_disparities(const Image& left, const Image& right, const std::vector<Eigen::Vector2f>& keypoints,
                             const DisparityOptions& options);

}  // namespace demslam

#pragma once

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/odometry/odometry.h"

namespace demslam {

struct LandmarkOptions {
  double min_depth_m = 2.0;   ///< nearer points see the rover's own wheels and shadow
  double max_depth_m = 25.0;  ///< farther ones know their height too badly
};

/// The triangulated points of a keyframe within the depth limits, in the left camera's frame, each with the first-order
/// covariance of its pixel and disparity (mathematics.md, "Stereo odometry").
KeyframeLandmarks ground_landmarks(std::size_t keyframe, const RectifiedRig& rig, const StereoFeatures& features,
                                   const MotionOptions& noise, const LandmarkOptions& options);

}  // namespace demslam

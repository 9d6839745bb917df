#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "demslam/features/features.h"
#include "demslam/geometry/camera.h"
#include "demslam/geometry/pose.h"
#include "demslam/image/image.h"
#include "demslam/odometry/correspondence.h"

namespace demslam {

/// What one rectified pair yields: left features and, where a right match was found, their disparity.
struct StereoFeatures {
  Features left;
  std::vector<float> disparity_px;               ///< per left keypoint; 0 where there is none
  std::vector<Eigen::Vector2f> disparity_slope;  ///< d(disparity) / d(u, v) around the keypoint; empty when not known

  bool has_depth(std::size_t i) const { return disparity_px[i] > 0.0F; }
  StereoPixel stereo_pixel(std::size_t i) const {
    return {left.keypoints[i].x(), left.keypoints[i].y(), disparity_px[i]};
  }
};

struct MotionOptions {
  double min_depth_m = 0.3, max_depth_m = 60.0;
  /// Farther points, and those beyond max_depth_m, count by their direction: it ties the rotation down, while what is
  /// left of calibration errors biases small disparities, and with them the scale of the motion (ORB-SLAM2's close and
  /// far points, with its 40 baselines, Mur-Artal and Tardos 2017, III-A).
  double max_depth_baselines = 40.0;
  bool use_far_points = true;
  double ransac_threshold_px = 2.0;
  int ransac_iterations = 300;
  int min_inliers = 15;
  double min_inlier_ratio = 0.5;     ///< of the matches that must agree with a motion
  double pixel_sigma_px = 0.7;       ///< standard deviation of a keypoint coordinate, for weights and covariance
  double disparity_sigma_px = 0.25;  ///< standard deviation of a disparity; patches align better than keypoints repeat
  double far_sigma_px = 1.0;         ///< standard deviation of a far point's disparity, errors of calibration included
  std::uint64_t seed = 1;
};

/// Disparity below which a point is far.
double far_disparity_px(const RectifiedRig& rig, const MotionOptions& options);

/// Noise of keypoints detected in both views, and of those of a that b was searched for by aligning patches.
StereoNoise detected_noise(const RectifiedRig& rig, const MotionOptions& options);
StereoNoise aligned_noise(const RectifiedRig& rig, const MotionOptions& options);

/// Relative motion between two stereo views.
struct Motion {
  bool ok = false;
  std::string reason;  ///< why not, when not ok
  Pose T_a_b;          ///< left camera b in left camera a
  Matrix6d covariance =
      Matrix6d::Identity();  ///< of the right perturbation of T_a_b (rotation, translation), from the refined Hessian
  int matches = 0, inliers = 0;
  double rms_px = 0.0;  ///< reprojection error of the inliers
};

/// Finds the disparity of each left keypoint along the row of the right image (disparity.h) ; a far
/// one where they are used.
StereoFeatures match_stereo(const RectifiedRig& rig, Features left_features, const Image& left, const Image& right,
                            const MotionOptions& options);

/// Matches two views, then P3P in RANSAC on the 3-D points of a, then a robust refinement of the reprojection error in
/// both cameras of b that accounts for the errors of a's points too. `guess_T_a_b` helps when given. Deterministic for
/// a seed.
Motion estimate_motion(const RectifiedRig& rig, const StereoFeatures& a, const StereoFeatures& b, Matcher& matcher,
                       const MotionOptions& options, const Pose* guess_T_a_b = nullptr);

/// The same for points already matched.
Motion estimate_motion(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                       const MotionOptions& options, const Pose* guess_T_a_b = nullptr);

}  // namespace demslam

#pragma once

#include <memory>
#include <vector>

#include "demslam/odometry/correspondence.h"
#include "demslam/odometry/motion.h"

namespace demslam {

/// A stereo view with its images: what patches can be aligned with.
struct StereoView {
  std::shared_ptr<const StereoFeatures> features;
  std::shared_ptr<const Image> left, right;
};

/// Points of view a found again in view b by aligning their patches, from a pose that is known to a few pixels. Unlike
/// descriptor matches these are exact to a tenth of a pixel, and need no feature to be detected twice. The patch is
/// warped by the motion and by the slope of the surface. Both the correspondences and the indices of their keypoints in
/// a.
struct DirectMatches {
  std::vector<Correspondence> correspondences;
  std::vector<int> keypoints_a;
};
DirectMatches match_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Pose& T_a_b);

/// Replaces the matches of a motion by direct ones and refines it with them. A motion that fewer of them support than
/// its own matches did stays as it is.
Motion refine_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Motion& motion,
                       const MotionOptions& options);

}  // namespace demslam

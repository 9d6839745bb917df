#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/odometry/correspondence.h"
#include "demslam/odometry/motion.h"

namespace demslam {

/// A stereo view with its images: what patches can be aligned with. A frame that shows nothing has neither features nor
/// images.
struct StereoView {
  std::shared_ptr<const StereoFeatures> features;
  std::shared_ptr<const Image> left, right;
  TimestampNs t_ns = 0;
};

/// A point of view a, carried by the patch around its pixel.
struct PatchPoint {
  StereoPixel pixel;
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();  ///< d(disparity) / d(u, v) around it
};

/// A point found by aligning a patch, with the covariance of (u, v, d).
struct DirectSighting {
  StereoPixel pixel;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Finds a point of view a in view b by aligning its patch, from a pose known to a pixel or two: (u, v, d) exact to a
/// tenth of a pixel, with no need of a feature detected twice. The patch is warped by the motion and the slope of the
/// surface. d = 0 where the right image of b shows something else; none where the point is not seen.
std::optional<DirectSighting> find_directly(const RectifiedRig& rig, const StereoView& a, const PatchPoint& point,
                                            const StereoView& b, const Pose& T_b_a);

/// All points of a with a depth that are found in b.
std::vector<Correspondence> match_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b,
                                           const Pose& T_a_b);

/// Replaces the matches of a motion by direct ones and refines it with them. A motion that fewer of them support than
/// its own matches did stays as it is.
Motion refine_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Motion& motion,
                       const MotionOptions& options);

}  // namespace demslam

#pragma once

#include <vector>

#include "demslam/odometry/motion.h"

namespace demslam {

/// Matches only near where a predicted motion puts the points of a, which finds enough where frames lie too far apart
/// for a search of the whole image: among fewer rivals a worse likeness will do. `ratio` is Lowe's. One to one, and
/// with disparities that agree.
std::vector<Correspondence> match_near(const RectifiedRig& rig, const StereoFeatures& a, const StereoFeatures& b,
                                       const Pose& T_a_b, double radius_px, double ratio);

}  // namespace demslam

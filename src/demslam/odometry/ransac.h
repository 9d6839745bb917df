#pragma once

#include <cstdint>
#include <optional>

#include "demslam/odometry/correspondence.h"

namespace demslam {

struct RansacOptions {
  double threshold_px = 2.0;  ///< on u, v and disparity in view b together
  int iterations = 300;       ///< at most; fewer where the inliers are many
  int min_inliers = 15;
  std::uint64_t seed = 1;
};

/// The pose T_a_b most correspondences agree with: P3P on the 3-D points of a and their pixels in b, scored by the
/// truncated squared error (MSAC). A `guess` competes with the drawn poses. None if fewer than `min_inliers` agree.
std::optional<Pose> find_pose(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                              const RansacOptions& options, const Pose* guess_T_a_b = nullptr);

}  // namespace demslam

#pragma once

#include <gtsam/geometry/Pose3.h>

#include "demslam/geometry/pose.h"

namespace demslam {

// Both types perturb on the right with the rotation first, so covariances and tangent vectors pass unchanged.
inline gtsam::Pose3 to_gtsam(const Pose& pose) {
  return gtsam::Pose3(gtsam::Rot3(pose.rotation_matrix()), pose.translation());
}

inline Pose from_gtsam(const gtsam::Pose3& pose) { return Pose(pose.rotation().matrix(), pose.translation()); }

}  // namespace demslam

#include "demslam/slam/landmarks.h"

namespace demslam {
namespace {

/// d(x, y, z) / d(u, v, d) of RectifiedRig::unproject.
Eigen::Matrix3d unproject_jacobian(const RectifiedRig& rig, const Eigen::Vector3d& p_left, double disparity_px) {
  const double per_px = p_left.z() / rig.focal_px;
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  J(0, 0) = per_px;
  J(1, 1) = per_px;
  J.col(2) = -p_left / disparity_px;
  return J;
}

}  // namespace

KeyframeLandmarks ground_landmarks(std::size_t keyframe, const RectifiedRig& rig, const StereoFeatures& features,
                                   const MotionOptions& noise, const LandmarkOptions& options) {
  const Eigen::Vector3d sigma_px(noise.pixel_sigma_px, noise.pixel_sigma_px, noise.disparity_sigma_px);
  KeyframeLandmarks landmarks{.keyframe = keyframe};
  for (std::size_t i = 0; i < features.left.size(); ++i) {
    if (!features.has_depth(i)) continue;
    const double disparity_px = features.disparity_px[i];
    const Eigen::Vector3d p_left = rig.unproject(features.left.keypoints[i].cast<double>(), disparity_px);
    if (p_left.z() < options.min_depth_m || p_left.z() > options.max_depth_m) continue;
    const Eigen::Matrix3d J = unproject_jacobian(rig, p_left, disparity_px);
    landmarks.points.push_back({p_left, J * sigma_px.cwiseAbs2().asDiagonal() * J.transpose()});
  }
  return landmarks;
}

}  // namespace demslam

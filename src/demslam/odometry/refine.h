#pragma once

#include <optional>
#include <vector>

#include "demslam/odometry/correspondence.h"

namespace demslam {

struct RefinedPose {
  Pose T_a_b;
  Matrix6d covariance = Matrix6d::Identity();  ///< of the right perturbation of T_a_b (rotation, translation)
  std::vector<bool> inlier;                    ///< per correspondence
  int inliers = 0;
  double rms_px = 0.0;  ///< of u, v of the inliers in view b
};

/// Robust least squares over T_a_b alone. In the space (u, v, d) a motion is a projective map, close to linear even for
/// far points, so the points of a need no variables: their errors are carried over to b and weigh each residual,
///     e = b - g(T, a),   cov(e) = S_b + G S_a G^T,   G = dg / da
/// (Matthies; Demirdjian and Darrell 2001), to first order the same as optimising every point. Cauchy weights on the
/// Mahalanobis distance. The covariance is the inverse Hessian, raised where the inliers scatter more than `noise`
/// says. None when the geometry is degenerate.
std::optional<RefinedPose> refine_pose(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                                       const StereoNoise& noise, const Pose& initial_T_a_b);

/// Residual e = b - g(T, a) and its Jacobian by the right perturbation of T_a_b; for tests and for gating.
struct TransferError {
  Eigen::Vector3d error;
  Eigen::Matrix<double, 3, 6> jacobian;
  Eigen::Matrix3d covariance;
  bool in_front = false;  ///< of camera b; nothing else holds if not
};
TransferError transfer_error(const RectifiedRig& rig, const Correspondence& correspondence, const StereoNoise& noise,
                             const Pose& T_a_b);

}  // namespace demslam

#include "demslam/odometry/refine.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace demslam {
namespace {

constexpr int kIterations = 15;
constexpr double kCauchyScale = 2.0;                                  // in standard deviations
constexpr double kInlierChiSquare2 = 13.8, kInlierChiSquare3 = 16.3;  // 99.9 %, 2 and 3 degrees of freedom
constexpr double kMinDepthM = 1e-3;
constexpr double kMaxStep = 10.0;  // radians and metres: a larger step is divergence
constexpr double kConverged = 1e-9;

/// Without a disparity in b its row is left out by giving it no information.
Eigen::Matrix3d information_of(const TransferError& transfer, bool with_disparity) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  if (with_disparity) {
    information = transfer.covariance.inverse();
  } else {
    information.topLeftCorner<2, 2>() = transfer.covariance.topLeftCorner<2, 2>().inverse();
  }
  return information;
}

/// Normal equations H * xi = b of the robustly weighted residuals, and what the inliers alone say.
struct System {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  Matrix6d inlier_information = Matrix6d::Zero();
  double inlier_chi_square = 0.0;
  double inlier_squared_px = 0.0;  // u and v
  int inliers = 0, measured = 0;
  std::vector<bool> inlier;

  void add(std::size_t i, const TransferError& transfer, bool with_disparity) {
    const Eigen::Matrix3d W = information_of(transfer, with_disparity);
    const double chi_square = transfer.error.dot(W * transfer.error);
    const double weight = 1.0 / (1.0 + chi_square / (kCauchyScale * kCauchyScale));
    const Eigen::Matrix<double, 6, 3> JtW = transfer.jacobian.transpose() * W;
    const Matrix6d information = JtW * transfer.jacobian;
    H += weight * information;
    b -= weight * JtW * transfer.error;
    if (chi_square > (with_disparity ? kInlierChiSquare3 : kInlierChiSquare2)) return;
    inlier[i] = true;
    ++inliers;
    measured += with_disparity ? 3 : 2;
    inlier_information += information;
    inlier_chi_square += chi_square;
    inlier_squared_px += transfer.error.head<2>().squaredNorm();
  }

  /// Inverse Hessian, raised by the inliers' own scatter where that exceeds the assumed noise.
  Matrix6d covariance() const {
    const double freedom = std::max(1.0, measured - 6.0);
    return inlier_information.inverse() * std::max(1.0, inlier_chi_square / freedom);
  }
};

System build_system(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                    const StereoNoise& noise, const Pose& T_a_b) {
  System system;
  system.inlier.assign(correspondences.size(), false);
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const TransferError transfer = transfer_error(rig, correspondences[i], noise, T_a_b);
    if (transfer.in_front) system.add(i, transfer, has_disparity(correspondences[i].b));
  }
  return system;
}

bool is_degenerate(const Matrix6d& H) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(H, Eigen::EigenvaluesOnly);
  return !(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[5]) || !(eigen.eigenvalues()[0] > 0.0);
}

}  // namespace

TransferError transfer_error(const RectifiedRig& rig, const Correspondence& correspondence, const StereoNoise& noise,
                             const Pose& T_a_b) {
  TransferError result;
  const Eigen::Vector3d p_b = T_a_b.inverse() * unproject(rig, correspondence.a);
  result.in_front = p_b.z() > kMinDepthM;
  if (!result.in_front) return result;
  const Eigen::Matrix3d H = projection_jacobian(rig, p_b);
  const Eigen::Matrix3d G = H * T_a_b.rotation_matrix().transpose() * unprojection_jacobian(rig, correspondence.a);
  const Eigen::Matrix3d S_a = noise.covariance_a(correspondence.a),
                        S_b = noise.covariance_b(correspondence.b, correspondence.covariance_b);
  result.error = correspondence.b - project(rig, p_b);
  result.jacobian = -H * point_jacobian(p_b);
  result.covariance = S_b + G * S_a * G.transpose();
  return result;
}

std::optional<RefinedPose> refine_pose(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                                       const StereoNoise& noise, const Pose& initial_T_a_b) {
  // Gauss-Newton with weights held fixed within a step: its fixed point, sum J^T W e = 0, is free of the bias that
  // minimising e^T cov(T)^-1 e would have (it would prefer poses that enlarge the covariance).
  Pose T_a_b = initial_T_a_b;
  for (int i = 0; i < kIterations; ++i) {
    const System system = build_system(rig, correspondences, noise, T_a_b);
    const Vector6d step = system.H.ldlt().solve(system.b);
    if (!step.allFinite() || step.norm() > kMaxStep) return std::nullopt;
    T_a_b = T_a_b * Pose::exp(step);
    if (step.norm() < kConverged) break;
  }
  const System system = build_system(rig, correspondences, noise, T_a_b);
  if (system.inliers < 3 || is_degenerate(system.inlier_information)) return std::nullopt;
  return RefinedPose{.T_a_b = T_a_b,
                     .covariance = system.covariance(),
                     .inlier = system.inlier,
                     .inliers = system.inliers,
                     .rms_px = std::sqrt(system.inlier_squared_px / system.inliers)};
}

}  // namespace demslam

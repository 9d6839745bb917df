#include "demslam/graph/odometry_chain.h"

#include <Eigen/Cholesky>
#include <cassert>

namespace demslam {
namespace {

constexpr std::size_t kStride = 16;  // keyframes between two stored sums

}  // namespace

void CompoundMotion::append(const Pose& T_measured, const Matrix6d& step_covariance, const Vector4d& systematic) {
  const Pose step = corrected(T_measured, systematic);
  const Matrix6d A = step.inverse().adjoint();
  T_a_b = T_a_b * step;
  covariance = A * covariance * A.transpose() + step_covariance;
  by_systematic = A * by_systematic + corrected_jacobian(T_measured, systematic);
}

OdometryChain::Packed OdometryChain::pack(const Matrix6d& matrix) {
  Packed packed;
  for (int row = 0, n = 0; row < 6; ++row) {
    for (int col = 0; col <= row; ++col) packed[n++] = matrix(row, col);
  }
  return packed;
}

Matrix6d OdometryChain::unpack(const Packed& packed) {
  Matrix6d matrix;
  for (int row = 0, n = 0; row < 6; ++row) {
    for (int col = 0; col <= row; ++col) matrix(row, col) = matrix(col, row) = packed[n++];
  }
  return matrix;
}

void OdometryChain::Sums::append(const Link& link) {
  if (!link.measured) {
    ++gaps;
    return;
  }
  T_odometry = T_odometry * link.T_measured;
  const Matrix6d A = T_odometry.adjoint();
  covariance += A * unpack(link.covariance) * A.transpose();
  by_systematic += A * corrected_jacobian(link.T_measured, Vector4d::Zero());
}

void OdometryChain::add_keyframe() {
  Link link;
  if (!links_.empty()) link.path_m = links_.back().path_m;
  if (links_.size() % kStride == 0 && !links_.empty()) sums_.push_back(sums_at(links_.size() - 1));
  links_.push_back(link);
}

void OdometryChain::link(const Pose& T_measured, const Matrix6d& covariance) {
  Link& link = links_.back();
  assert(links_.size() > 1 && !link.measured);
  link.T_measured = T_measured;
  link.covariance = pack(covariance);
  link.path_m += T_measured.translation().norm();
  link.measured = true;
}

/// sums_[n] holds everything before keyframe (n + 1) * kStride.
OdometryChain::Sums OdometryChain::sums_at(std::size_t keyframe) const {
  const std::size_t stored = keyframe / kStride;
  Sums sums = stored == 0 ? Sums{} : sums_[stored - 1];
  for (std::size_t k = stored == 0 ? 1 : stored * kStride; k <= keyframe; ++k) sums.append(links_[k]);
  return sums;
}

CompoundMotion OdometryChain::compound(std::size_t a, std::size_t b, const Vector4d& systematic) const {
  CompoundMotion motion;
  for (std::size_t k = a + 1; k <= b; ++k) {
    assert(links_[k].measured);
    motion.append(links_[k].T_measured, unpack(links_[k].covariance), systematic);
  }
  return motion;
}

std::optional<Matrix6d> OdometryChain::covariance(std::size_t a, std::size_t b,
                                                  const Matrix4d& systematic_covariance) const {
  Sums from, to;
  if (b - a < kStride) {  // no longer than the way to the next sums
    for (std::size_t k = a + 1; k <= b; ++k) to.append(links_[k]);
  } else {
    from = sums_at(a);
    to = sums_at(b);
  }
  if (from.gaps != to.gaps) return std::nullopt;
  const Matrix6d A = to.T_odometry.inverse().adjoint();
  const Matrix64d J = A * (to.by_systematic - from.by_systematic);
  const Matrix6d random = A * (to.covariance - from.covariance) * A.transpose();
  return random + J * systematic_covariance * J.transpose();
}

std::optional<Matrix6d> OdometryChain::bend(std::size_t a, std::size_t m, std::size_t b,
                                            const Matrix4d& systematic_covariance) const {
  std::vector<Pose> T_a_k(1);
  std::vector<Eigen::Vector3d> sums{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  // of the places before each
  for (std::size_t k = a + 1; k <= b; ++k) {
    if (!links_[k].measured) return std::nullopt;
    T_a_k.push_back(T_a_k.back() * links_[k].T_measured);
    sums.push_back(sums.back() + T_a_k.back().translation());
  }
  const auto all = static_cast<double>(T_a_k.size());
  const Pose& T_a_m = T_a_k[m - a];
  const Eigen::Vector3d from_centre = T_a_m.translation() - sums.back() / all;
  Matrix6d covariance = Matrix6d::Zero();
  Matrix64d by_systematic = Matrix64d::Zero();
  for (std::size_t k = a + 1; k <= b; ++k) {  // the motion to k swings all that lies on its side away from m
    const std::size_t i = k - a;
    const bool ahead = k > m;
    const double count = ahead ? all - static_cast<double>(i) : static_cast<double>(i);
    const Eigen::Vector3d sum = ahead ? Eigen::Vector3d(sums.back() - sums[i]) : sums[i];
    const Eigen::Vector3d lever = sum - count * T_a_k[i].translation();
    const Eigen::Matrix3d R = T_a_k[i].rotation_matrix();
    Matrix6d J = Matrix6d::Zero();
    J.topLeftCorner<3, 3>() = count * R;
    J.bottomLeftCorner<3, 3>() = -skew(lever + count * from_centre) * R;
    J.bottomRightCorner<3, 3>() = count * R;
    J *= (ahead ? 1.0 : -1.0) / all;
    covariance += J * unpack(links_[k].covariance) * J.transpose();
    by_systematic += J * corrected_jacobian(links_[k].T_measured, Vector4d::Zero());
  }
  covariance += by_systematic * systematic_covariance * by_systematic.transpose();
  Matrix6d into_m = Matrix6d::Zero();
  into_m.topLeftCorner<3, 3>() = into_m.bottomRightCorner<3, 3>() = T_a_m.rotation_matrix().transpose();
  return into_m * covariance * into_m.transpose();
}

Pose OdometryChain::motion(std::size_t a, std::size_t b, const Vector4d& systematic) const {
  const Sums from = sums_at(a), to = sums_at(b);
  const Matrix64d J = to.T_odometry.inverse().adjoint() * (to.by_systematic - from.by_systematic);
  return from.T_odometry.inverse() * to.T_odometry * Pose::exp(J * systematic);
}

std::vector<Pose> OdometryChain::between(std::size_t a, std::size_t b, const Pose& T_map_a, const Pose& T_map_b,
                                         const Vector4d& systematic) const {
  std::vector<CompoundMotion> motions(1);
  for (std::size_t k = a + 1; k <= b; ++k) {
    motions.push_back(motions.back());
    motions.back().append(links_[k].T_measured, unpack(links_[k].covariance), systematic);
  }
  const Pose& T_a_b = motions.back().T_a_b;
  const Vector6d misfit = (T_a_b.inverse() * T_map_a.inverse() * T_map_b).log();
  const Vector6d weighted = motions.back().covariance.ldlt().solve(misfit);
  std::vector<Pose> poses;
  for (std::size_t n = 1; n + 1 < motions.size(); ++n) {
    const Matrix6d A = (T_a_b.inverse() * motions[n].T_a_b).adjoint();  // perturbation at k -> at b
    const Vector6d shift = motions[n].covariance * (A.transpose() * weighted);
    poses.push_back(T_map_a * motions[n].T_a_b * Pose::exp(shift));
  }
  return poses;
}

OdometryChain::Dependence OdometryChain::dependence(std::size_t a, std::size_t k, std::size_t b,
                                                    const Vector4d& systematic) const {
  const CompoundMotion to_k = compound(a, k, systematic), on = compound(k, b, systematic);
  const Matrix6d A_b_k = on.T_a_b.inverse().adjoint();
  const Matrix6d of_end = A_b_k * to_k.covariance * A_b_k.transpose() + on.covariance;
  const Matrix6d gain = of_end.ldlt().solve(A_b_k * to_k.covariance).transpose();
  const Matrix6d A_k_a = to_k.T_a_b.inverse().adjoint();
  return {.by_a = A_k_a - gain * A_b_k * A_k_a,
          .by_b = gain,
          .remainder = to_k.covariance - gain * of_end * gain.transpose()};
}

}  // namespace demslam

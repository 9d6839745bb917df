#include "demslam/graph/odometry_factor.h"

#include <boost/make_shared.hpp>
#include <cmath>

#include "demslam/graph/gtsam_pose.h"

namespace demslam {

Pose corrected(const Pose& T_i_j_measured, const Vector4d& systematic) {
  const double length_m = T_i_j_measured.translation().norm();
  Vector6d turn = Vector6d::Zero();
  turn.head<3>() = length_m * systematic.tail<3>();
  return Pose(T_i_j_measured.rotation() * Pose::exp(turn).rotation(),
              std::exp(systematic[0]) * T_i_j_measured.translation());
}

Matrix64d corrected_jacobian(const Pose& T_i_j_measured, const Vector4d& systematic) {
  const double length_m = T_i_j_measured.translation().norm();
  const gtsam::Vector3 turn = length_m * systematic.tail<3>();
  Matrix64d J = Matrix64d::Zero();
  J.block<3, 3>(0, 1) = length_m * gtsam::Rot3::ExpmapDerivative(turn);
  const gtsam::Rot3 rotation = to_gtsam(corrected(T_i_j_measured, systematic)).rotation();
  J.block<3, 1>(3, 0) = rotation.unrotate(std::exp(systematic[0]) * T_i_j_measured.translation());
  return J;
}

namespace {

/// Log( T_hat^-1 * T_i^-1 * T_j ) with the derivatives by the poses and by T_hat's right perturbation.
struct RelativeError {
  gtsam::Vector6 error;
  gtsam::Matrix6 by_i, by_j, by_measurement;

  RelativeError(const gtsam::Pose3& T_hat, const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j) {
    const gtsam::Pose3 T_i_j = T_map_i.inverse() * T_map_j, deviation = T_hat.inverse() * T_i_j;
    error = gtsam::Pose3::Logmap(deviation, by_j);
    by_i = -by_j * T_i_j.inverse().AdjointMap();
    by_measurement = -by_j * deviation.inverse().AdjointMap();
  }
};

}  // namespace

SystematicOdometryFactor::SystematicOdometryFactor(gtsam::Key i, gtsam::Key j, gtsam::Key systematic, const Pose& T_i_j,
                                                   const gtsam::SharedNoiseModel& noise)
    : NoiseModelFactor3(noise, i, j, systematic), T_i_j_(T_i_j) {}

gtsam::Vector SystematicOdometryFactor::evaluateError(const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j,
                                                      const gtsam::Vector4& systematic,
                                                      boost::optional<gtsam::Matrix&> H_i,
                                                      boost::optional<gtsam::Matrix&> H_j,
                                                      boost::optional<gtsam::Matrix&> H_systematic) const {
  const RelativeError r(to_gtsam(corrected(T_i_j_, systematic)), T_map_i, T_map_j);
  if (H_i) *H_i = r.by_i;
  if (H_j) *H_j = r.by_j;
  if (H_systematic) *H_systematic = r.by_measurement * corrected_jacobian(T_i_j_, systematic);
  return r.error;
}

gtsam::NonlinearFactor::shared_ptr SystematicOdometryFactor::clone() const {
  return boost::make_shared<SystematicOdometryFactor>(*this);
}

CompoundOdometryFactor::CompoundOdometryFactor(gtsam::Key i, gtsam::Key j, gtsam::Key systematic, const Pose& T_i_j,
                                               const Matrix64d& J, const Vector4d& s_0,
                                               const gtsam::SharedNoiseModel& noise)
    : NoiseModelFactor3(noise, i, j, systematic), T_i_j_(T_i_j), J_(J), s_0_(s_0) {}

gtsam::Vector CompoundOdometryFactor::evaluateError(const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j,
                                                    const gtsam::Vector4& systematic,
                                                    boost::optional<gtsam::Matrix&> H_i,
                                                    boost::optional<gtsam::Matrix&> H_j,
                                                    boost::optional<gtsam::Matrix&> H_systematic) const {
  gtsam::Matrix6 H_exp;
  const gtsam::Pose3 T_hat = to_gtsam(T_i_j_) * gtsam::Pose3::Expmap(J_ * (systematic - s_0_), H_exp);
  const RelativeError r(T_hat, T_map_i, T_map_j);
  if (H_i) *H_i = r.by_i;
  if (H_j) *H_j = r.by_j;
  if (H_systematic) *H_systematic = r.by_measurement * H_exp * J_;
  return r.error;
}

gtsam::NonlinearFactor::shared_ptr CompoundOdometryFactor::clone() const {
  return boost::make_shared<CompoundOdometryFactor>(*this);
}

}  // namespace demslam

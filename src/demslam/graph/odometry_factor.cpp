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

SystematicOdometryFactor::SystematicOdometryFactor(gtsam::Key i, gtsam::Key j, gtsam::Key systematic, const Pose& T_i_j,
                                                   const gtsam::SharedNoiseModel& noise)
    : NoiseModelFactor3(noise, i, j, systematic), T_i_j_(T_i_j) {}

gtsam::Vector SystematicOdometryFactor::evaluateError(const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j,
                                                      const gtsam::Vector4& systematic,
                                                      boost::optional<gtsam::Matrix&> H_i,
                                                      boost::optional<gtsam::Matrix&> H_j,
                                                      boost::optional<gtsam::Matrix&> H_systematic) const {
  const gtsam::Pose3 T_i_j = T_map_i.inverse() * T_map_j;
  const gtsam::Pose3 T_hat = to_gtsam(corrected(T_i_j_, systematic));
  const gtsam::Pose3 deviation = T_hat.inverse() * T_i_j;
  gtsam::Matrix6 H_log;
  const gtsam::Vector6 error = gtsam::Pose3::Logmap(deviation, H_log);
  if (H_i) *H_i = -H_log * T_i_j.inverse().AdjointMap();
  if (H_j) *H_j = H_log;
  if (H_systematic) {
    const double length_m = T_i_j_.translation().norm();
    Eigen::Matrix<double, 6, 4> correction = Eigen::Matrix<double, 6, 4>::Zero();  // right perturbation of T_hat by s
    correction.block<3, 3>(0, 1) = length_m * gtsam::Rot3::ExpmapDerivative(length_m * systematic.tail<3>());
    correction.block<3, 1>(3, 0) = T_hat.rotation().unrotate(T_hat.translation());
    *H_systematic = -H_log * deviation.inverse().AdjointMap() * correction;
  }
  return error;
}

gtsam::NonlinearFactor::shared_ptr SystematicOdometryFactor::clone() const {
  return boost::make_shared<SystematicOdometryFactor>(*this);
}

}  // namespace demslam

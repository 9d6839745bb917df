#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include "demslam/geometry/pose.h"

namespace demslam {

using Vector4d = Eigen::Matrix<double, 4, 1>;
using Matrix4d = Eigen::Matrix<double, 4, 4>;
using Matrix64d = Eigen::Matrix<double, 6, 4>;

/// Systematic errors of an odometry over a stretch of path: (scale error, rotation bias about the body's x, y, z in rad
/// per metre). A true motion shows as a measured one of translation / exp(scale) and rotation * Exp(-bias * length).
Pose corrected(const Pose& T_i_j_measured, const Vector4d& systematic);
/// Derivative of its right perturbation by the systematic errors.
Matrix64d corrected_jacobian(const Pose& T_i_j_measured, const Vector4d& systematic);

/// r = Log( corrected(T_i_j, s)^-1 * T_i^-1 * T_j ): relative pose whose systematic errors s are a state of the graph.
class SystematicOdometryFactor : public gtsam::NoiseModelFactor3<gtsam::Pose3, gtsam::Pose3, gtsam::Vector4> {
 public:
  SystematicOdometryFactor(gtsam::Key i, gtsam::Key j, gtsam::Key systematic, const Pose& T_i_j,
                           const gtsam::SharedNoiseModel& noise);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j,
                              const gtsam::Vector4& systematic, boost::optional<gtsam::Matrix&> H_i = boost::none,
                              boost::optional<gtsam::Matrix&> H_j = boost::none,
                              boost::optional<gtsam::Matrix&> H_systematic = boost::none) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  Pose T_i_j_;
};

/// r = Log( (T_i_j * Exp(J (s - s_0)))^-1 * T_i^-1 * T_j ): many motions compounded into one, whose systematic errors
/// are a state of the graph; linear in their deviation from s_0, at which they were compounded.
class CompoundOdometryFactor : public gtsam::NoiseModelFactor3<gtsam::Pose3, gtsam::Pose3, gtsam::Vector4> {
 public:
  CompoundOdometryFactor(gtsam::Key i, gtsam::Key j, gtsam::Key systematic, const Pose& T_i_j, const Matrix64d& J,
                         const Vector4d& s_0, const gtsam::SharedNoiseModel& noise);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_i, const gtsam::Pose3& T_map_j,
                              const gtsam::Vector4& systematic, boost::optional<gtsam::Matrix&> H_i = boost::none,
                              boost::optional<gtsam::Matrix&> H_j = boost::none,
                              boost::optional<gtsam::Matrix&> H_systematic = boost::none) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  Pose T_i_j_;
  Matrix64d J_;
  Vector4d s_0_;
};

}  // namespace demslam

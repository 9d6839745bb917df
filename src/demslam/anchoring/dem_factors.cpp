#include "demslam/anchoring/dem_factors.h"

#include <boost/make_shared.hpp>
#include <cmath>
#include <numbers>
#include <utility>

namespace demslam {
namespace {

bool covered(const Dem& dem, const gtsam::Values& values, gtsam::Key key, const Eigen::Vector3d& p_body) {
  const gtsam::Point3 p = values.at<gtsam::Pose3>(key).transformFrom(p_body);
  return dem.covers(p.x(), p.y());
}

Eigen::Vector3d normal_of(const Eigen::Vector2d& gradient) {
  return Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
}

/// Derivative of normal_of().
Eigen::Matrix<double, 3, 2> normal_jacobian(const Eigen::Vector2d& gradient) {
  const Eigen::Vector3d n = normal_of(gradient);
  return -(Eigen::Matrix3d::Identity() - n * n.transpose()).leftCols<2>() / std::sqrt(1.0 + gradient.squaredNorm());
}

/// x and y of the rotation vector that takes e_z to the unit vector m, and its derivative by m.
Eigen::Vector2d tilt(const Eigen::Vector3d& m, Eigen::Matrix<double, 2, 3>* jacobian) {
  const Eigen::Vector2d axis(-m.y(), m.x());  // of length sin(angle)
  const double sine = axis.norm(), cosine = m.z();
  const double angle = std::atan2(sine, cosine);
  const bool small = sine < 1e-6;
  if (small && cosine < 0.0) {
    if (jacobian != nullptr) *jacobian << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0;
    return {std::numbers::pi, 0.0};
  }
  const double scale = small ? 1.0 : angle / sine;
  if (jacobian != nullptr) {
    const double scale_by_sine = small ? -2.0 / 3.0 : (cosine * sine - angle) / (sine * sine * sine);  // over sine
    const Eigen::RowVector3d scale_jacobian(scale_by_sine * m.x(), scale_by_sine * m.y(), -1.0);
    *jacobian << 0.0, -scale, 0.0, scale, 0.0, 0.0;
    *jacobian += axis * scale_jacobian;
  }
  return scale * axis;
}

}  // namespace

Eigen::Matrix<double, 3, 6> point_jacobian(const gtsam::Pose3& T_map_body, const Eigen::Vector3d& p_body) {
  const Eigen::Matrix3d R = T_map_body.rotation().matrix();
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -R * skew(p_body), R;
  return jacobian;
}

DemHeightFactor::DemHeightFactor(gtsam::Key pose, std::shared_ptr<const Dem> dem, const Eigen::Vector3d& p_body,
                                 const gtsam::SharedNoiseModel& noise, TerrainGradient gradient)
    : NoiseModelFactor1(noise, pose), dem_(std::move(dem)), p_body_(p_body), gradient_(gradient) {}

gtsam::Vector DemHeightFactor::evaluateError(const gtsam::Pose3& T_map_body, boost::optional<gtsam::Matrix&> H) const {
  const gtsam::Point3 p = T_map_body.transformFrom(p_body_);
  const auto terrain = dem_->sample(p.x(), p.y());
  if (H) {
    const bool full = terrain && gradient_ == TerrainGradient::full;
    const Eigen::Vector2d slope = full ? terrain->gradient : Eigen::Vector2d::Zero();
    *H = Eigen::RowVector3d(-slope.x(), -slope.y(), terrain ? 1.0 : 0.0) * point_jacobian(T_map_body, p_body_);
  }
  return gtsam::Vector1(terrain ? p.z() - terrain->height_m : 0.0);
}

bool DemHeightFactor::active(const gtsam::Values& values) const { return covered(*dem_, values, key(), p_body_); }

gtsam::NonlinearFactor::shared_ptr DemHeightFactor::clone() const { return boost::make_shared<DemHeightFactor>(*this); }

DemNormalFactor::DemNormalFactor(gtsam::Key pose, std::shared_ptr<const Dem> dem, const Eigen::Vector3d& p_body_ground,
                                 const gtsam::SharedNoiseModel& noise, TerrainGradient gradient)
    : NoiseModelFactor1(noise, pose), dem_(std::move(dem)), p_body_ground_(p_body_ground), gradient_(gradient) {}

gtsam::Vector DemNormalFactor::evaluateError(const gtsam::Pose3& T_map_body, boost::optional<gtsam::Matrix&> H) const {
  const gtsam::Point3 p = T_map_body.transformFrom(p_body_ground_);
  const auto terrain = dem_->sample(p.x(), p.y());
  if (!terrain) {
    if (H) *H = gtsam::Matrix::Zero(2, 6);
    return gtsam::Vector2(0.0, 0.0);
  }
  const Eigen::Matrix3d R_body_map = T_map_body.rotation().matrix().transpose();
  const Eigen::Vector3d n_body = R_body_map * normal_of(terrain->gradient);
  Eigen::Matrix<double, 2, 3> by_normal;
  const Eigen::Vector2d error = tilt(n_body, H ? &by_normal : nullptr);
  if (H) {
    Eigen::Matrix<double, 3, 6> normal_by_pose = Eigen::Matrix<double, 3, 6>::Zero();
    normal_by_pose.leftCols<3>() = skew(n_body);
    if (gradient_ == TerrainGradient::full) {
      normal_by_pose += R_body_map * normal_jacobian(terrain->gradient) * terrain->hessian *
                        point_jacobian(T_map_body, p_body_ground_).topRows<2>();
    }
    *H = by_normal * normal_by_pose;
  }
  return error;
}

bool DemNormalFactor::active(const gtsam::Values& values) const {
  return covered(*dem_, values, key(), p_body_ground_);
}

gtsam::NonlinearFactor::shared_ptr DemNormalFactor::clone() const { return boost::make_shared<DemNormalFactor>(*this); }

}  // namespace demslam

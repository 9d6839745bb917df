#include "demslam/anchoring/sky_factors.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <numbers>
#include <utility>

#include "demslam/geometry/pose.h"

namespace demslam {
namespace {

Eigen::Matrix<double, 2, 3> across(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d first = direction.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> rows;
  rows << first.transpose(), direction.cross(first).transpose();
  return rows;
}

}  // namespace

DirectionFactor::DirectionFactor(gtsam::Key pose, const Eigen::Vector3d& direction_map,
                                 const Eigen::Vector3d& direction_body, const gtsam::SharedNoiseModel& noise)
    : NoiseModelFactor1(noise, pose), direction_map_(direction_map), across_(across(direction_body)) {}

gtsam::Vector DirectionFactor::evaluateError(const gtsam::Pose3& T_map_body, boost::optional<gtsam::Matrix&> H) const {
  const Eigen::Vector3d expected_body = T_map_body.rotation().unrotate(direction_map_);
  if (H) {
    *H = gtsam::Matrix::Zero(2, 6);
    H->leftCols<3>() = across_ * skew(expected_body);  // R^T d turns against the body
  }
  return across_ * expected_body;
}

gtsam::NonlinearFactor::shared_ptr DirectionFactor::clone() const { return boost::make_shared<DirectionFactor>(*this); }

boost::shared_ptr<DirectionFactor> sun_factor(std::size_t keyframe, const Eigen::Vector3d& sun_map,
                                              const Eigen::Vector3d& sun_body, double sigma_deg) {
  constexpr double kKernelSigmas = 2.5;
  const double sigma_rad = sigma_deg * std::numbers::pi / 180.0;
  const auto noise = gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(kKernelSigmas),
                                                       gtsam::noiseModel::Isotropic::Sigma(2, sigma_rad));
  return boost::make_shared<DirectionFactor>(keyframe, sun_map, sun_body, noise);
}

SkylineFactor::SkylineFactor(gtsam::Key pose, std::shared_ptr<const Skyline> skyline,
                             std::vector<Eigen::Vector3d> directions_body, const gtsam::SharedNoiseModel& noise)
    : NoiseModelFactor1(noise, pose), skyline_(std::move(skyline)), directions_body_(std::move(directions_body)) {}

gtsam::Vector SkylineFactor::evaluateError(const gtsam::Pose3& T_map_body, boost::optional<gtsam::Matrix&> H) const {
  const Eigen::Index n = std::ssize(directions_body_);
  const Eigen::Matrix3d R = T_map_body.rotation().matrix();
  gtsam::Vector error(n);
  if (H) *H = gtsam::Matrix::Zero(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d d = R * directions_body_[i];
    const double flat2 = d.head<2>().squaredNorm(), azimuth = std::atan2(d.y(), d.x());
    error[i] = std::atan2(d.z(), std::sqrt(flat2)) - skyline_->elevation(azimuth);
    if (!H) continue;
    const Eigen::RowVector3d by_azimuth = Eigen::RowVector3d(-d.y(), d.x(), 0.0) / flat2;
    const Eigen::RowVector3d by_elevation =
        Eigen::RowVector3d(-d.x() * d.z(), -d.y() * d.z(), flat2) / (std::sqrt(flat2) * d.squaredNorm());
    H->block<1, 3>(i, 0) = -(by_elevation - skyline_->slope(azimuth) * by_azimuth) * R * skew(directions_body_[i]);
  }
  return error;
}

gtsam::NonlinearFactor::shared_ptr SkylineFactor::clone() const { return boost::make_shared<SkylineFactor>(*this); }

gtsam::SharedNoiseModel skyline_noise(std::size_t rows, double sigma_rad, double effective, double kernel_sigmas) {
  const double inflation = std::sqrt(std::max(1.0, static_cast<double>(rows) / effective));
  return gtsam::noiseModel::Robust::Create(
      gtsam::noiseModel::mEstimator::Cauchy::Create(kernel_sigmas * std::sqrt(static_cast<double>(rows))),
      gtsam::noiseModel::Isotropic::Sigma(rows, sigma_rad * inflation));
}

}  // namespace demslam

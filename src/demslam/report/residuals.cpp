#include "demslam/report/residuals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace demslam {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

double chi_square_of(const Vector6d& error, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> cholesky(covariance);
  if (cholesky.info() != Eigen::Success) return std::numeric_limits<double>::quiet_NaN();
  return error.dot(cholesky.solve(error));
}

}  // namespace

RelativeResidual residual_of(const RelativePose& measurement, const Pose& T_map_i, const Pose& T_map_j) {
  const Vector6d error = (measurement.T_i_j.inverse() * T_map_i.inverse() * T_map_j).log();
  return {measurement.i, measurement.j, error.tail<3>().norm(), kDegrees * error.head<3>().norm(),
          chi_square_of(error, measurement.covariance)};
}

TerrainResidual residual_of(const Dem& dem, const Pose& T_map_body, const Eigen::Vector3d& p_body_ground) {
  const Eigen::Vector3d p = T_map_body * p_body_ground;
  const auto sample = dem.sample(p.x(), p.y());
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (!sample) return {kNone, kNone};
  const Eigen::Vector3d normal = Eigen::Vector3d(-sample->gradient.x(), -sample->gradient.y(), 1.0).normalized();
  const double cosine = normal.dot(T_map_body.rotation() * Eigen::Vector3d::UnitZ());
  return {p.z() - sample->height_m, kDegrees * std::acos(std::clamp(cosine, -1.0, 1.0))};
}

}  // namespace demslam

#include "demslam/anchoring/patch_factor.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <boost/make_shared.hpp>
#include <cmath>
#include <utility>

#include "demslam/anchoring/dem_factors.h"

namespace demslam {
namespace {

gtsam::SharedNoiseModel robust_unit(std::size_t rows, double kernel_sigmas) {
  const double width = kernel_sigmas * std::sqrt(static_cast<double>(rows));
  return gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(width),
                                           gtsam::noiseModel::Unit::Create(rows));
}

}  // namespace

Eigen::MatrixXd cell_covariance(const std::vector<PatchCell>& cells, const DemErrorModel& dem_error) {
  const Eigen::Index n = std::ssize(cells);
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      // Tilt of the body shortens no distance that matters against the correlation length.
      covariance(i, j) = dem_error.covariance((cells[i].p_body - cells[j].p_body).norm());
    }
    covariance(i, i) += cells[i].variance_m2;
  }
  return covariance;
}

double relief_evidence(const TerrainPatch& patch, const Pose& T_map_body, const Dem& dem,
                       const DemErrorModel& dem_error) {
  TerrainPatch covered;
  std::vector<Eigen::Vector3d> points;
  for (const PatchCell& cell : patch.cells) {
    const Eigen::Vector3d p = T_map_body * cell.p_body;
    if (!dem.covers(p.x(), p.y())) continue;
    covered.cells.push_back(cell);
    points.push_back(p);
  }
  const Eigen::Index n = std::ssize(points);
  if (n < 4) return 0.0;
  Eigen::MatrixX3d plane(n, 3);
  Eigen::VectorXd seen(n), mapped(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    plane.row(i) << 1.0, points[i].x() - T_map_body.translation().x(), points[i].y() - T_map_body.translation().y();
    seen[i] = points[i].z();
    mapped[i] = *dem.height(points[i].x(), points[i].y());
  }
  const Eigen::VectorXd flat = plane * plane.colPivHouseholderQr().solve(mapped);
  const Eigen::MatrixXd information = cell_covariance(covered.cells, dem_error).inverse();
  const auto misfit = [&](const Eigen::VectorXd& expected) {
    const Eigen::VectorXd r = seen - expected, weighted = information * r;
    const double weight = information.sum();
    return r.dot(weighted) - weighted.sum() * weighted.sum() / weight;
  };
  return misfit(flat) - misfit(mapped);
}

TerrainPatchFactor::TerrainPatchFactor(const TerrainPatch& patch, std::shared_ptr<const Dem> dem,
                                       const DemErrorModel& dem_error, const PatchFactorOptions& options,
                                       TerrainGradient gradient)
    : NoiseModelFactor1(robust_unit(patch.cells.size(), options.kernel_sigmas), patch.keyframe),
      cells_(patch.cells),
      dem_(std::move(dem)),
      gradient_(gradient) {
  const Eigen::MatrixXd covariance = cell_covariance(cells_, dem_error);
  soft_m_ = options.soft_sigmas * covariance.diagonal().cwiseSqrt();
  square_root_information_ = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  covariance.llt().matrixL().solveInPlace(square_root_information_);
  square_root_information_ *= std::sqrt(options.information_scale);
}

gtsam::Vector TerrainPatchFactor::evaluateError(const gtsam::Pose3& T_map_body,
                                                boost::optional<gtsam::Matrix&> H) const {
  const Eigen::Index n = std::ssize(cells_);
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const gtsam::Point3 p = T_map_body.transformFrom(cells_[i].p_body);
    const auto terrain = dem_->sample(p.x(), p.y());
    if (!terrain) continue;
    const double scaled = (p.z() - terrain->height_m) / soft_m_[i];
    residuals[i] = soft_m_[i] * std::asinh(scaled);
    if (!H) continue;
    Eigen::RowVector3d by_point(0.0, 0.0, 1.0);
    if (gradient_ == TerrainGradient::full) by_point.head<2>() = -terrain->gradient.transpose();
    jacobian.row(i) = by_point * point_jacobian(T_map_body, cells_[i].p_body) / std::sqrt(1.0 + scaled * scaled);
  }
  if (H) *H = square_root_information_.triangularView<Eigen::Lower>() * jacobian;
  return square_root_information_.triangularView<Eigen::Lower>() * residuals;
}

bool TerrainPatchFactor::active(const gtsam::Values& values) const {
  const auto& T_map_body = values.at<gtsam::Pose3>(key());
  std::size_t covered = 0;
  for (const PatchCell& cell : cells_) {
    const gtsam::Point3 p = T_map_body.transformFrom(cell.p_body);
    covered += dem_->covers(p.x(), p.y());
  }
  return 2 * covered > cells_.size();
}

gtsam::NonlinearFactor::shared_ptr TerrainPatchFactor::clone() const {
  return boost::make_shared<TerrainPatchFactor>(*this);
}

}  // namespace demslam

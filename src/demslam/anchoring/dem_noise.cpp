#include "demslam/anchoring/dem_noise.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace demslam {
namespace {

constexpr double kMemory = 0.95;      // per patch: of some 400 m
constexpr double kPriorSigma = 0.35;  // of the scale's logarithm
constexpr double kEvidence = 0.6;     // neighbouring patches share errors, and their model is not exact
constexpr Eigen::Index kFewestLeft = 4;

/// What a patch says of its DEM once the pose is free: values whose variances are 1 + scale^2 times the spread.
struct Contrasts {
  Eigen::VectorXd squared, spread;
};

/// Cells' heights above the DEM, and how they change with the pose: height, tilt, shift.
struct Residuals {
  Eigen::VectorXd height_m;
  Eigen::MatrixXd by_pose;
  std::vector<PatchCell> cells;
};

Residuals residuals_of(const TerrainPatch& patch, const Pose& T_map_body, const Dem& dem) {
  Residuals residuals{.height_m = Eigen::VectorXd(std::ssize(patch.cells)),
                      .by_pose = Eigen::MatrixXd(std::ssize(patch.cells), 5)};
  Eigen::Index n = 0;
  for (const PatchCell& cell : patch.cells) {
    const Eigen::Vector3d p = T_map_body * cell.p_body, offset = p - T_map_body.translation();
    const auto terrain = dem.sample(p.x(), p.y());
    if (!terrain) continue;
    residuals.height_m[n] = p.z() - terrain->height_m;
    residuals.by_pose.row(n) << 1.0, offset.x(), offset.y(), terrain->gradient.x(), terrain->gradient.y();
    residuals.cells.push_back(cell);
    ++n;
  }
  residuals.height_m.conservativeResize(n);
  residuals.by_pose.conservativeResize(n, Eigen::NoChange);
  return residuals;
}

Eigen::MatrixXd error_covariance(const std::vector<PatchCell>& cells, const DemErrorModel& error) {
  const Eigen::Index n = std::ssize(cells);
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      covariance(i, j) = error.covariance((cells[i].p_body - cells[j].p_body).norm());
    }
  }
  return covariance;
}

/// Combinations of the residuals that no pose changes, made independent.
Contrasts contrasts_of(const Residuals& residuals, const DemErrorModel& error) {
  const Eigen::Index n = residuals.height_m.size();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(residuals.by_pose);
  const Eigen::Index left = n - qr.rank();
  if (left < kFewestLeft) return {};
  const Eigen::MatrixXd Q = qr.householderQ();
  const Eigen::MatrixXd N = Q.rightCols(left);
  Eigen::VectorXd own(n);
  for (Eigen::Index i = 0; i < n; ++i) own[i] = residuals.cells[i].variance_m2;
  const Eigen::MatrixXd by_dem = N.transpose() * error_covariance(residuals.cells, error) * N;
  const Eigen::MatrixXd by_cells = N.transpose() * own.asDiagonal() * N;
  // by_dem v = spread by_cells v, with v^T by_cells v = 1.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(by_dem, by_cells);
  const Eigen::VectorXd values = eigen.eigenvectors().transpose() * (N.transpose() * residuals.height_m);
  return {values.cwiseAbs2(), eigen.eigenvalues().cwiseMax(0.0)};
}

double log_likelihood(const Contrasts& contrasts, double scale) {
  const Eigen::ArrayXd variance = 1.0 + scale * scale * contrasts.spread.array();
  return -0.5 * (variance.log() + contrasts.squared.array() / variance).sum();
}

}  // namespace

double DemNoise::scale_at(int i) { return 0.25 * std::exp2(6.0 * i / (kScales - 1)); }

void DemNoise::add(const TerrainPatch& patch, const Pose& T_map_body, const Dem& dem, const DemErrorModel& stated) {
  const Contrasts contrasts = contrasts_of(residuals_of(patch, T_map_body, dem), stated);
  if (contrasts.squared.size() == 0) return;
  for (int i = 0; i < kScales; ++i) {
    log_likelihood_[i] = kMemory * log_likelihood_[i] + kEvidence * log_likelihood(contrasts, scale_at(i));
  }
}

double DemNoise::scale() const {
  const double most = *std::ranges::max_element(log_likelihood_);
  double sum = 0.0, weighted = 0.0;
  for (int i = 0; i < kScales; ++i) {
    const double log_scale = std::log(scale_at(i)), prior = log_scale / kPriorSigma;
    const double weight = std::exp(log_likelihood_[i] - most - 0.5 * prior * prior);
    sum += weight;
    weighted += weight * log_scale;
  }
  return std::max(1.0, std::exp(weighted / sum));
}

}  // namespace demslam

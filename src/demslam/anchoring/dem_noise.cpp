#include "demslam/anchoring/dem_noise.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "demslam/anchoring/patch_factor.h"

namespace demslam {
namespace {

constexpr int kLevels = 7;              // up to eight times
constexpr double kMemory = 0.95;        // per patch: of some 400 m
constexpr double kStatedPatches = 5.0;  // what was said counts like so many that fit all levels alike
constexpr double kBetter = 0.97;        // of the mean square: a level that fits no better than this is not changed to
constexpr std::size_t kFewestCells = 10;
constexpr double kStencilCells = 3.0;  // what interpolation reads around a point

MapWindow around(const TerrainPatch& patch, const Pose& T_map_body, double margin_m) {
  const Eigen::Vector3d middle = T_map_body.translation();
  MapWindow window{middle.x(), middle.y(), middle.x(), middle.y()};
  for (const PatchCell& cell : patch.cells) {
    const Eigen::Vector3d p = T_map_body * cell.p_body;
    window = {std::min(window.west_m, p.x()), std::min(window.south_m, p.y()), std::max(window.east_m, p.x()),
              std::max(window.north_m, p.y())};
  }
  return {window.west_m - margin_m, window.south_m - margin_m, window.east_m + margin_m, window.north_m + margin_m};
}

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

/// An orthonormal basis of what the pose changes.
Eigen::MatrixXd basis_of(const Eigen::MatrixXd& by_pose) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(by_pose);
  return qr.householderQ() * Eigen::MatrixXd::Identity(by_pose.rows(), qr.rank());
}

/// Sum of the variances of what is left beside a basis.
double left_variance(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& covariance) {
  return covariance.trace() - basis.cwiseProduct(covariance * basis).sum();
}

}  // namespace

DemNoise::DemNoise(std::shared_ptr<const Dem> dem, const DemErrorModel& stated, bool filter, bool levels)
    : dem_(std::move(dem)), stated_(stated) {
  for (int i = 0; i < (levels ? kLevels : 1); ++i) {
    const double scale = std::pow(2.0, 0.5 * i);
    std::optional<WienerFilter> for_scale;
    if (filter && !dem_->has_sigma()) {
      for_scale = WienerFilter::of(dem_->raster(), {scale * stated.sigma_m, stated.correlation_length_m});
    }
    if (i > 0 && !for_scale) break;
    levels_.push_back({.scale = scale, .filter = std::move(for_scale)});
  }
  const std::optional<WienerFilter>& as_stated = levels_.front().filter;
  const double sigma_m = as_stated ? as_stated->remaining().sigma_m : stated.sigma_m;
  expected_m2_ = kStatedPatches * sigma_m * sigma_m;
  for (Level& level : levels_) level.left_m2 = expected_m2_;
}

void DemNoise::add(const TerrainPatch& patch, const Pose& T_map_body) {
  expected_m2_ *= kMemory;
  for (Level& level : levels_) {
    level.left_m2 *= kMemory;
    add(patch, T_map_body, level);
  }
  const auto least = std::ranges::min_element(levels_, {}, &Level::left_m2);
  if (least->left_m2 < kBetter * levels_[best_].left_m2) best_ = least - levels_.begin();
}

void DemNoise::add(const TerrainPatch& patch, const Pose& T_map_body, Level& level) {
  std::optional<Dem> filtered;
  if (level.filter) {
    const MapWindow window = around(patch, T_map_body, kStencilCells * dem_->raster().cell_m);
    filtered.emplace(level.filter->filtered(dem_->raster(), window), dem_->interpolation());
  }
  const Residuals residuals = residuals_of(patch, T_map_body, filtered ? *filtered : *dem_);
  if (residuals.cells.size() < kFewestCells) return;
  const Eigen::MatrixXd basis = basis_of(residuals.by_pose);
  const auto freedom = static_cast<double>(basis.rows() - basis.cols());
  level.left_m2 += (residuals.height_m - basis * (basis.transpose() * residuals.height_m)).squaredNorm() / freedom;
  if (!level.filter) expected_m2_ += left_variance(basis, cell_covariance(residuals.cells, stated_)) / freedom;
}

double DemNoise::scale() const {
  const Level& best = levels_[best_];
  if (best.filter) return best.scale;
  return std::sqrt(std::max(1.0, best.left_m2 / expected_m2_));
}

}  // namespace demslam

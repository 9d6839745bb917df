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
// Of the mean square that the patches leave: a level is changed to only where it leaves less than so much of it.
constexpr double kBetterThanStated = 0.7, kBetter = 0.97;
constexpr double kFound = 0.6;  // of the noise that a level stands for, the DEM itself must show so much
constexpr std::size_t kFewestCells = 10;
constexpr double kStencilCells = 3.0;  // what interpolation reads around a point

MapWindow around(const TerrainPatch& patch, const Pose& T_map_body, double margin_m) {
  const Eigen::Vector3d& middle = T_map_body.translation();
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
    : dem_(std::move(dem)), stated_patches_(kStatedPatches) {
  for (int i = 0; i < (levels ? kLevels : 1); ++i) {
    const double scale = std::pow(2.0, 0.5 * i);
    const DemErrorModel error{scale * stated.sigma_m, stated.correlation_length_m};
    std::optional<WienerFilter> for_scale;
    if (filter && !dem_->has_sigma()) for_scale = WienerFilter::of(dem_->raster(), error);
    if (i > 0 && (!for_scale || for_scale->noise_found(dem_->raster()) < kFound)) break;
    levels_.push_back({.scale = scale, .filter = for_scale, .error = for_scale ? for_scale->remaining() : error});
  }
}

void DemNoise::add(const TerrainPatch& patch, const Pose& T_map_body) {
  bool counts = false;
  for (Level& level : levels_) counts |= add(patch, T_map_body, level);
  if (!counts) return;
  patches_ = kMemory * patches_ + 1.0;
  stated_patches_ *= kMemory;
  const auto misfit = [this](const Level& level) { return misfit_m2(level); };
  const auto least = std::ranges::min_element(levels_, {}, misfit);
  if (misfit(*least) > kBetterThanStated * misfit(levels_.front())) {
    best_ = 0;
  } else if (best_ == 0 || misfit(*least) < kBetter * misfit(levels_[best_])) {
    best_ = least - levels_.begin();
  }
}

bool DemNoise::add(const TerrainPatch& patch, const Pose& T_map_body, Level& level) {
  std::optional<Dem> filtered;
  if (level.filter) {
    const MapWindow window = around(patch, T_map_body, kStencilCells * dem_->raster().cell_m);
    filtered.emplace(level.filter->filtered(dem_->raster(), window), dem_->interpolation());
  }
  const Residuals residuals = residuals_of(patch, T_map_body, filtered ? *filtered : *dem_);
  if (residuals.cells.size() < kFewestCells) return false;
  const Eigen::MatrixXd basis = basis_of(residuals.by_pose);
  const auto freedom = static_cast<double>(basis.rows() - basis.cols());
  const Eigen::VectorXd left = residuals.height_m - basis * (basis.transpose() * residuals.height_m);
  level.left_m2 = kMemory * level.left_m2 + left.squaredNorm() / freedom;
  const double expected_m2 = left_variance(basis, cell_covariance(residuals.cells, level.error));
  level.expected_m2 = kMemory * level.expected_m2 + expected_m2 / freedom;
  return true;
}

double DemNoise::expected_m2(const Level& level) const {
  return patches_ > 0.0 ? level.expected_m2 / patches_ : level.error.covariance(0.0);
}

double DemNoise::misfit_m2(const Level& level) const {
  return stated_patches_ * expected_m2(levels_.front()) + level.left_m2;
}

double DemNoise::surprise(const Level& level) const {
  const double stated_m2 = stated_patches_ * expected_m2(level);
  return std::sqrt((stated_m2 + level.left_m2) / (stated_m2 + level.expected_m2));
}

double DemNoise::scale() const {
  const Level& best = levels_[best_];
  return best.filter ? best.scale : std::max(1.0, surprise(best));
}

DemErrorModel DemNoise::error() const {
  const Level& best = levels_[best_];
  const double stated_m = levels_.front().error.sigma_m;
  if (!best.filter) return {scale() * stated_m, best.error.correlation_length_m};
  // A patch sees no waves longer than itself: of those the level says as much as before. Hence the geometric mean.
  const double sigma_m = best.error.sigma_m * std::min(1.0, std::sqrt(surprise(best)));
  return {std::max(stated_m, sigma_m), best.error.correlation_length_m};
}

}  // namespace demslam

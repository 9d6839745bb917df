#include "demslam/anchoring/terrain_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "demslam/anchoring/patch_factor.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

Pose moved(const Pose& T_map_body, const Eigen::Vector2d& offset_m, double turn_rad, double climb_m) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
  return {turn * T_map_body.rotation(),
          T_map_body.translation() + Eigen::Vector3d(offset_m.x(), offset_m.y(), climb_m)};
}

/// W with W^T W = scale (C^-1 - C^-1 A (A^T C^-1 A + prior)^-1 A^T C^-1): residuals as the best height and tilt leave
/// them. By the inverse lemma that is scale (C + A prior^-1 A^T)^-1 with a height prior wide enough not to matter.
Eigen::MatrixXd marginal_whitening(const Eigen::MatrixXd& covariance, const Eigen::Matrix2Xd& cells_m,
                                   double sigma_tilt_rad, double scale) {
  constexpr double kFreeHeight = 1e3;  // metres
  Eigen::MatrixXd total = covariance;
  total.array() += kFreeHeight * kFreeHeight;
  total += sigma_tilt_rad * sigma_tilt_rad * (cells_m.transpose() * cells_m);
  Eigen::MatrixXd whitening = Eigen::MatrixXd::Identity(total.rows(), total.cols());
  total.llt().matrixL().solveInPlace(whitening);
  return std::sqrt(scale) * whitening;
}

/// Takes the plane out of residuals that their noise and the tilt's prior leave room for: I - A (A^T A + prior)^-1 A^T.
Eigen::MatrixXd levelling(const Eigen::Matrix2Xd& cells_m, double variance_m2, double sigma_tilt_rad) {
  Eigen::MatrixX3d plane(cells_m.cols(), 3);
  plane << Eigen::VectorXd::Ones(cells_m.cols()), cells_m.transpose();
  Eigen::Matrix3d normal = plane.transpose() * plane;
  normal.diagonal().tail<2>().array() += variance_m2 / (sigma_tilt_rad * sigma_tilt_rad);
  return Eigen::MatrixXd::Identity(cells_m.cols(), cells_m.cols()) - plane * normal.ldlt().solve(plane.transpose());
}

}  // namespace

TerrainSearch::TerrainSearch(const TerrainPatch& submap, const Pose& T_map_body, std::shared_ptr<const Dem> dem,
                             const DemErrorModel& dem_error, const PatchFactorOptions& options, double sigma_tilt_rad)
    : submap_(submap),
      T_map_body_(T_map_body),
      dem_(std::move(dem)),
      dem_error_(dem_error),
      options_(options),
      sigma_tilt_rad_(sigma_tilt_rad),
      cells_m_(2, std::ssize(submap.cells)),
      heights_m_(std::ssize(submap.cells)) {
  for (Eigen::Index i = 0; i < cells_m_.cols(); ++i) {
    const Eigen::Vector3d p_map = T_map_body * submap_.cells[i].p_body;
    cells_m_.col(i) = (p_map - T_map_body.translation()).head<2>();
    heights_m_[i] = static_cast<float>(p_map.z());
  }
  const Eigen::MatrixXd covariance = cell_covariance(submap_.cells, dem_error);
  soft_m_ = (options.soft_sigmas * covariance.diagonal().cwiseSqrt()).cast<float>();
  levelling_ = levelling(cells_m_, covariance.diagonal().mean(), sigma_tilt_rad).cast<float>();
  whitening_ = marginal_whitening(covariance, cells_m_, sigma_tilt_rad, options.information_scale).cast<float>();
}

/// One column per position of a row: ground over DEM.
Eigen::MatrixXf TerrainSearch::heights_above(const Eigen::Matrix2Xd& cells, const Eigen::Vector2d& first, double step_m,
                                             int count, std::vector<bool>& covered) const {
  Eigen::MatrixXf above = Eigen::MatrixXf::Zero(cells.cols(), count);
  covered.assign(count, true);
  for (int i = 0; i < count; ++i) {
    for (Eigen::Index c = 0; c < cells.cols() && covered[i]; ++c) {
      const auto height = dem_->height(first.x() + i * step_m + cells(0, c), first.y() + cells(1, c));
      covered[i] = height.has_value();
      if (height) above(c, i) = heights_m_[c] - static_cast<float>(*height);
    }
  }
  return above;
}

Eigen::VectorXf TerrainSearch::chi_squares(const Eigen::MatrixXf& above) const {
  Eigen::MatrixXf residuals = levelling_ * above;
  residuals.array().colwise() /= soft_m_.array();
  residuals = residuals.unaryExpr([](float x) { return std::asinh(x); });
  residuals.array().colwise() *= soft_m_.array();
  return (whitening_.triangularView<Eigen::Lower>() * residuals).colwise().squaredNorm();
}

std::vector<TerrainMatch> TerrainSearch::scan(const SearchWindow& window) const {
  const int half = std::max(1, static_cast<int>(std::ceil(window.radius_m / window.step_m)));
  const int side = 2 * half + 1;
  const double reach_m = std::max(window.step_m, std::sqrt(cells_m_.colwise().squaredNorm().maxCoeff()));
  const bool all_round = window.heading_rad >= std::numbers::pi;
  const int turns = std::max(1, static_cast<int>(std::ceil(window.heading_rad / (window.step_m / reach_m))));
  const double turn_step = window.heading_rad / turns;
  const Eigen::Vector2d centre = T_map_body_.translation().head<2>();

  std::vector<TerrainMatch> best(static_cast<std::size_t>(side) * side,
                                 {.chi_square = std::numeric_limits<double>::infinity()});
  std::vector<bool> covered;
  for (int turn = -turns; turn <= turns - all_round; ++turn) {
    const Eigen::Matrix2Xd cells = Eigen::Rotation2Dd(turn * turn_step).toRotationMatrix() * cells_m_;
    for (int row = 0; row < side; ++row) {
      const Eigen::Vector2d offset(-half * window.step_m, (row - half) * window.step_m);
      const Eigen::MatrixXf above = heights_above(cells, centre + offset, window.step_m, side, covered);
      const Eigen::VectorXf chi_square = chi_squares(above);
      for (int col = 0; col < side; ++col) {
        TerrainMatch& match = best[static_cast<std::size_t>(row) * side + col];
        if (!covered[col] || chi_square[col] >= match.chi_square) continue;
        const double climb_m = -above.col(col).mean();
        match.T_map_body =
            moved(T_map_body_, offset + Eigen::Vector2d(col * window.step_m, 0.0), turn * turn_step, climb_m);
        match.chi_square = chi_square[col];
        match.at_edge =
            row == 0 || col == 0 || row == side - 1 || col == side - 1 || (!all_round && std::abs(turn) == turns);
      }
    }
  }
  std::erase_if(best, [](const TerrainMatch& match) { return !std::isfinite(match.chi_square); });
  return best;
}

std::optional<TerrainMatch> TerrainSearch::refined(const TerrainMatch& start) const {
  const TerrainPatchFactor factor(submap_, dem_, dem_error_, options_);
  const Eigen::Vector2d level = Eigen::Vector2d::Constant(1.0 / (sigma_tilt_rad_ * sigma_tilt_rad_));
  const Pose& T_start = start.T_map_body;
  TerrainMatch match = start;
  double damping = 1e-3, before = std::numeric_limits<double>::infinity();
  Pose T = T_start, T_next = T_start;
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d downhill = Vector6d::Zero();
  for (int iteration = 0; iteration < 30; ++iteration) {
    gtsam::Matrix H;
    const gtsam::Vector r = factor.evaluateError(to_gtsam(T_next), H);
    const Eigen::Vector2d tilt = (T_start.inverse() * T_next).log().head<2>();
    const double chi_square = r.squaredNorm() + level.dot(tilt.cwiseAbs2());
    const bool better = chi_square < before;
    if (better) {
      const bool done = before - chi_square < 1e-4 * (1.0 + chi_square);
      T = T_next;
      before = chi_square;
      hessian = H.transpose() * H;
      hessian.diagonal().head<2>() += level;
      downhill = -H.transpose() * r;
      downhill.head<2>() -= level.cwiseProduct(tilt);
      if (done) break;
    }
    damping = std::clamp(better ? damping / 5.0 : damping * 10.0, 1e-9, 1e9);
    Matrix6d damped = hessian;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += 1e-9;
    T_next = T * Pose::exp(damped.ldlt().solve(downhill));
  }
  gtsam::Values values;
  values.insert(submap_.keyframe, to_gtsam(T));
  if (!factor.active(values)) return std::nullopt;
  match.T_map_body = T;
  match.chi_square = before;
  match.information = hessian;
  return match;
}

}  // namespace demslam

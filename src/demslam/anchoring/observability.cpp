#include "demslam/anchoring/observability.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <boost/make_shared.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "demslam/anchoring/patch_factor.h"
#include "demslam/base/error.h"
#include "demslam/dem/wiener.h"
#include "demslam/geometry/angle.h"
#include "demslam/geometry/covariance.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

/// The DEM as the estimator will see it.
BelievedDem seen(std::shared_ptr<const Dem> dem, const AnchoringOptions& options) {
  const DemErrorModel error{options.sigma_dem_m, options.dem_correlation_m};
  return options.filter_dem ? most_probable(std::move(dem), error) : BelievedDem{std::move(dem), error};
}

/// Points of the route, `step_m` of path apart.
std::vector<Eigen::Vector2d> resampled(const std::vector<Eigen::Vector2d>& route, double step_m) {
  std::vector<Eigen::Vector2d> points;
  double due_m = 0.0;
  for (std::size_t i = 1; i < route.size(); ++i) {
    const double length_m = (route[i] - route[i - 1]).norm();
    for (; due_m < length_m; due_m += step_m)
      points.push_back(route[i - 1] + due_m / length_m * (route[i] - route[i - 1]));
    due_m -= length_m;
  }
  return points;
}

/// Standing on the DEM, level with its slope, towards the next point. Height zero where there is none.
Pose standing(const Dem& dem, const Eigen::Vector2d& at, const Eigen::Vector2d& towards) {
  const DemSample ground = dem.sample(at.x(), at.y()).value_or(DemSample{});
  const double yaw = std::atan2(towards.y(), towards.x());
  const Eigen::Vector3d up = Eigen::Vector3d(-ground.gradient.x(), -ground.gradient.y(), 1.0).normalized();
  const Eigen::Quaterniond tilt = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  return {tilt * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()), {at.x(), at.y(), ground.height_m}};
}

bool in_view(const Eigen::Vector2d& p, const Pose& T_map_body, const ObservabilityOptions& o) {
  const Eigen::Vector2d d = p - T_map_body.translation().head<2>();
  const double bearing = std::atan2(d.y(), d.x()) - yaw_of(T_map_body.rotation());
  return d.norm() < o.view_m && d.norm() > 2.0 && std::cos(bearing) > std::cos(o.view_half_angle_deg * kRadPerDeg);
}

/// The patch that is seen between two poses, rigidly tied to the first.
TerrainPatch patch_between(std::size_t keyframe, const Pose& from, const Pose& to, const Dem& dem,
                           const ObservabilityOptions& o) {
  TerrainPatch patch{.keyframe = keyframe};
  const double cell_m = o.anchoring.patch.cell_m;
  const Eigen::Vector2d centre = 0.5 * (from.translation() + to.translation()).head<2>();
  const int reach = static_cast<int>(std::ceil((o.view_m + o.anchoring.patch.length_m) / cell_m));
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      const Eigen::Vector2d p = centre + cell_m * Eigen::Vector2d(i, j);
      const auto height = dem.height(p.x(), p.y());
      if (!height || !(in_view(p, from, o) || in_view(p, to, o))) continue;
      patch.cells.push_back({.p_body = from.inverse() * Eigen::Vector3d(p.x(), p.y(), *height),
                             .variance_m2 = o.sigma_cell_m * o.sigma_cell_m,
                             .points = o.anchoring.patch.min_points});
    }
  }
  return patch;
}

Matrix6d diagonal(double rotation_rad, double translation_m) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(rotation_rad * rotation_rad),
      Eigen::Vector3d::Constant(translation_m * translation_m);
  return variance.asDiagonal();
}

/// A rotation error in the middle of a step also moves its end.
Matrix6d motion_covariance(double step_m, const ObservabilityOptions& o) {
  const double rotation = o.rotation_deg_per_sqrt_m * kRadPerDeg * std::sqrt(step_m);
  Matrix6d covariance = diagonal(rotation, o.translation_m_per_sqrt_m * std::sqrt(step_m));
  const double lever = 0.5 * step_m, v = rotation * rotation;
  covariance(4, 4) += v * step_m * step_m / 3.0;
  covariance(5, 5) += v * step_m * step_m / 3.0;
  covariance(2, 4) = covariance(4, 2) = v * lever;
  covariance(1, 5) = covariance(5, 1) = -v * lever;
  return covariance;
}

/// Horizontal, vertical and heading standard deviations of a body covariance, map axes.
void read(const Pose& T_map_body, const Matrix6d& covariance, PredictedPose& result) {
  const Eigen::Matrix3d position = position_covariance(T_map_body, covariance);
  result.horizontal_m = std::sqrt(position(0, 0) + position(1, 1));
  result.vertical_m = std::sqrt(position(2, 2));
  result.heading_deg = heading_sigma_rad(T_map_body, covariance) / kRadPerDeg;
}

/// The graph of an errorless drive, with or without the DEM.
class ErrorlessDrive {
 public:
  ErrorlessDrive(const BelievedDem& dem, const ObservabilityOptions& options, bool anchored)
      : dem_(dem), options_(options), anchored_(anchored), graph_({.systematic = options.systematic}) {}

  /// Covariance of the newest pose when it is reached.
  Matrix6d advance(const Pose& T_map_body, const Pose& next) {
    const std::size_t k = graph_.add_keyframe(T_map_body);
    if (k == 0) {
      graph_.add_prior(0, T_map_body, diagonal(options_.start_sigma_deg * kRadPerDeg, options_.start_sigma_m));
    } else {
      const Pose T_i_j = graph_.T_map_body(k - 1).inverse() * T_map_body;
      graph_.add_odometry({k - 1, k, T_i_j, motion_covariance(T_i_j.translation().norm(), options_)});
    }
    if (anchored_) add_patch(k, T_map_body, next);
    graph_.optimize_window(k > kWindow ? k - kWindow : 0);
    return graph_.newest_covariance();
  }

  PoseGraph& graph() { return graph_; }

 private:
  static constexpr std::size_t kWindow = 5;

  void add_patch(std::size_t k, const Pose& T_map_body, const Pose& next) {
    const TerrainPatch patch = patch_between(k, T_map_body, next, *dem_.dem, options_);
    if (std::ssize(patch.cells) < options_.anchoring.patch.min_cells) return;
    graph_.add_factor(
        boost::make_shared<TerrainPatchFactor>(patch, dem_.dem, dem_.error, options_.anchoring.patch_factor));
  }

  const BelievedDem& dem_;
  const ObservabilityOptions& options_;
  bool anchored_;
  PoseGraph graph_;
};

}  // namespace

std::vector<PredictedPose> predict_along(const std::vector<Eigen::Vector2d>& route, std::shared_ptr<const Dem> dem,
                                         const ObservabilityOptions& options, const Progress& progress) {
  const double step_m = options.anchoring.patch.length_m;
  const std::vector<Eigen::Vector2d> points = resampled(route, step_m);
  if (points.size() < 3)
    throw Error("the route is shorter than " + std::to_string(2.0 * step_m) + " m: too short to predict");
  if (!dem->covers(points.front().x(), points.front().y()))
    throw Error("the DEM has no height at the route's start: is the route in the DEM's map frame?");
  const BelievedDem seen_dem = seen(std::move(dem), options.anchoring);
  ErrorlessDrive anchored(seen_dem, options, true), odometry(seen_dem, options, false);
  std::vector<PredictedPose> result;
  for (std::size_t i = 0; i + 1 < points.size() && !progress.stop_requested(); ++i) {
    const Pose here = standing(*seen_dem.dem, points[i], points[i + 1] - points[i]);
    const Pose next = standing(*seen_dem.dem, points[i + 1], points[i + 1] - points[i]);
    PredictedPose without, with{.path_m = static_cast<double>(i) * step_m, .position_m = points[i]};
    read(here, odometry.advance(here, next), without);
    read(here, anchored.advance(here, next), with);
    with.on_dem = seen_dem.dem->covers(points[i].x(), points[i].y());
    with.odometry_horizontal_m = without.horizontal_m;
    result.push_back(with);
    progress.report(i + 1, points.size() - 1);
  }
  std::vector<std::size_t> all(result.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const auto afterwards = anchored.graph().covariances(all);
  for (const std::size_t i : all) {
    PredictedPose after;
    read(anchored.graph().T_map_body(i), afterwards[i], after);
    result[i].horizontal_after_m = after.horizontal_m;
  }
  return result;
}

namespace {

/// Ground around a cell that makes one patch, and the whitening of its residuals with height and tilt free.
struct Stencil {
  std::vector<Eigen::Vector2d> offsets_m;
  Eigen::MatrixXd information;  ///< of the cells, height and tilt projected out
};

Stencil stencil_of(const DemErrorModel& error, const ObservabilityOptions& o) {
  const double cell_m = o.anchoring.patch.cell_m, radius_m = 0.5 * (o.view_m + o.anchoring.patch.length_m);
  Stencil stencil;
  std::vector<PatchCell> cells;
  const int reach = static_cast<int>(radius_m / cell_m);
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      const Eigen::Vector2d p = cell_m * Eigen::Vector2d(i, j);
      if (p.norm() > radius_m) continue;
      stencil.offsets_m.push_back(p);
      cells.push_back({.p_body = {p.x(), p.y(), 0.0}, .variance_m2 = o.sigma_cell_m * o.sigma_cell_m});
    }
  }
  const Eigen::Index n = std::ssize(cells);
  Eigen::MatrixXd plane(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) plane.row(i) << 1.0, cells[i].p_body.x(), cells[i].p_body.y();
  const Eigen::MatrixXd information = cell_covariance(cells, error).inverse(), projected = information * plane;
  stencil.information = information - projected * (plane.transpose() * projected).inverse() * projected.transpose();
  stencil.information *= o.anchoring.patch_factor.information_scale;
  return stencil;
}

/// Horizontal standard deviation from the slopes of the stencil's cells; NaN where one has none.
double sigma_at(const Dem& dem, const Eigen::Vector2d& centre, const Stencil& stencil) {
  Eigen::MatrixX2d slopes(std::ssize(stencil.offsets_m), 2);
  for (Eigen::Index i = 0; i < slopes.rows(); ++i) {
    const Eigen::Vector2d p = centre + stencil.offsets_m[i];
    const auto ground = dem.sample(p.x(), p.y());
    if (!ground) return std::numeric_limits<double>::quiet_NaN();
    slopes.row(i) = ground->gradient.transpose();
  }
  constexpr double kNothing = 1e-6;  // 1/m^2: a kilometre
  const Eigen::Matrix2d information =
      slopes.transpose() * stencil.information * slopes + kNothing * Eigen::Matrix2d::Identity();
  return std::sqrt(information.inverse().trace());
}

}  // namespace

DemRaster predicted_sigma(const Dem& dem, const ObservabilityOptions& options, const Progress& progress) {
  const BelievedDem seen_dem = seen(std::make_shared<Dem>(dem), options.anchoring);
  const Stencil stencil = stencil_of(seen_dem.error, options);
  const DemRaster& fine = dem.raster();
  const double cell_m = std::max(options.information_cell_m, fine.cell_m);
  DemRaster result{.rows = std::max(1, static_cast<int>(fine.rows * fine.cell_m / cell_m)),
                   .cols = std::max(1, static_cast<int>(fine.cols * fine.cell_m / cell_m)),
                   .cell_m = cell_m,
                   .west_m = fine.west_m,
                   .north_m = fine.north_m,
                   .frame = fine.frame};
  for (int row = 0; row < result.rows; ++row) {
    for (int col = 0; col < result.cols; ++col) {
      const bool stop = progress.stop_requested();
      result.heights.push_back(stop ? std::nanf("")
                                    : static_cast<float>(sigma_at(*seen_dem.dem, result.centre(row, col), stencil)));
    }
    progress.report(row + 1, result.rows);
  }
  return result;
}

}  // namespace demslam

#include "demslam/experiment/traverse.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"
#include "demslam/geometry/angle.h"
#include "demslam/geometry/camera.h"
#include "demslam/graph/odometry_factor.h"
#include "demslam/sim/dem_product.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/terrain.h"

namespace demslam {
namespace {

constexpr double kLaneSpacing = 200.0, kLongestLane = 1500.0, kMargin = 120.0;  // metres

// Random streams of one seed.
enum Stream : std::uint64_t {
  kRouteStream = 1,
  kOdometryStream,
  kLandmarkStream,
  kStartStream,
  kSunStream,
  kDemStream
};

Vector6d random_twist(Random& random, double rotation_sigma, double translation_sigma) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? rotation_sigma : translation_sigma) * random.normal();
  return xi;
}

/// Lanes driven to and fro, wavy, with a turn at each end.
std::vector<Eigen::Vector2d> winding_lanes(double length_m, Random& random) {
  const double lane_m = std::min(length_m, kLongestLane);
  const int lanes = static_cast<int>(std::ceil(length_m / lane_m));
  const double phase = random.uniform(0.0, 2.0 * std::numbers::pi), wave_m = random.uniform(150.0, 300.0);
  std::vector<Eigen::Vector2d> way;
  for (int lane = 0; lane < lanes; ++lane) {
    const double y = (lane - 0.5 * (lanes - 1)) * kLaneSpacing;
    const int points = static_cast<int>(std::ceil(lane_m / 25.0));
    for (int i = 0; i <= points; ++i) {
      const double along = lane_m * i / points - 0.5 * lane_m;
      const double x = lane % 2 == 0 ? along : -along;
      way.emplace_back(x, y + 15.0 * std::sin(2.0 * std::numbers::pi * x / wave_m + phase + lane));
    }
  }
  return way;
}

RoverOptions rover_of(const TraverseOptions& options, Random& random) {
  RoverOptions rover;
  rover.length_m = options.length_m;
  rover.speed_m_per_s = options.keyframe_spacing_m;
  rover.frame_rate_hz = 1.0;
  if (options.loop) {
    rover.route = RouteKind::loop;
    rover.start_m = {0.0, -options.length_m / (2.0 * std::numbers::pi)};
  } else {
    rover.route = RouteKind::waypoints;
    rover.waypoints_m = winding_lanes(options.length_m, random);
  }
  return rover;
}

double terrain_size_m(const RoverOptions& rover, const TraverseOptions& options) {
  double reach_m = options.loop ? options.length_m / (2.0 * std::numbers::pi) : 0.0;
  for (const Eigen::Vector2d& p : rover.waypoints_m) reach_m = std::max(reach_m, p.cwiseAbs().maxCoeff());
  return 2.0 * (reach_m + kMargin);
}

/// A measured motion is the true one with the systematic errors put in and the random walk on top.
std::vector<RelativePose> measured_motions(const std::vector<Pose>& truth, const TraverseOptions& options) {
  const OdometryErrors& e = options.odometry;
  Random random(options.seed, kOdometryStream);
  Vector4d systematic;
  systematic[0] = e.scale_sigma * random.normal();
  for (int axis = 1; axis < 4; ++axis) systematic[axis] = e.rotation_bias_deg_per_m * kRadPerDeg * random.normal();
  std::vector<RelativePose> motions;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const Pose motion = truth[k - 1].inverse() * truth[k];
    const double sqrt_m = std::sqrt(motion.translation().norm());
    const double rotation_sigma = e.rotation_deg_per_sqrt_m * kRadPerDeg * sqrt_m;
    const double translation_sigma = e.translation_m_per_sqrt_m * sqrt_m;
    Vector6d variance;
    variance << Eigen::Vector3d::Constant(rotation_sigma * rotation_sigma),
        Eigen::Vector3d::Constant(translation_sigma * translation_sigma);
    const Pose measured =
        corrected(motion, -systematic) * Pose::exp(random_twist(random, rotation_sigma, translation_sigma));
    motions.push_back({k - 1, k, measured, variance.asDiagonal()});
  }
  return motions;
}

/// The stereo camera that sees the landmarks.
struct StereoNoise {
  RectifiedRig rig{.focal_px = 512.0, .baseline_m = 0.3};
  double disparity_sigma_px = 0.5, pixel_sigma_px = 0.35;
  double outlier_fraction = 0.03;

  LandmarkPoint measure(const Eigen::Vector3d& p_left, Random& random) const;
};

LandmarkPoint StereoNoise::measure(const Eigen::Vector3d& p_left, Random& random) const {
  const Eigen::Vector2d pixel =
      rig.project(p_left) + pixel_sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  double disparity = rig.disparity_px(p_left.z()) + disparity_sigma_px * random.normal();
  if (random.uniform() < outlier_fraction) disparity *= random.uniform(0.5, 2.0);
  disparity = std::max(disparity, 1.0);
  LandmarkPoint point{.p_left = rig.unproject(pixel, disparity)};
  const double across = point.p_left.z() / rig.focal_px * pixel_sigma_px;
  const Eigen::Vector3d along = point.p_left * (disparity_sigma_px / disparity);
  point.covariance = along * along.transpose();
  point.covariance.topLeftCorner<2, 2>() += across * across * Eigen::Matrix2d::Identity();
  return point;
}

double ground_height(const Terrain& terrain, double x_m, double y_m) {
  Patch point(x_m, y_m, 0.25, 1, 1);
  terrain.fill(point);
  return point.values.front();
}

KeyframeLandmarks seen_from(const Terrain& terrain, const Pose& T_map_left, int count, Random& random) {
  const StereoNoise stereo;
  const Eigen::Vector3d forward = T_map_left.rotation() * Eigen::Vector3d::UnitZ();
  const double heading = std::atan2(forward.y(), forward.x());
  KeyframeLandmarks landmarks;
  for (int i = 0; i < count; ++i) {
    const double range_m = random.uniform(3.0, 25.0), bearing = heading + random.uniform(-0.7, 0.7);
    const double x = T_map_left.translation().x() + range_m * std::cos(bearing);
    const double y = T_map_left.translation().y() + range_m * std::sin(bearing);
    const Eigen::Vector3d p_left = T_map_left.inverse() * Eigen::Vector3d(x, y, ground_height(terrain, x, y));
    if (p_left.z() > 1.0) landmarks.points.push_back(stereo.measure(p_left, random));
  }
  return landmarks;
}

/// The believed start: a centimetre and a hundredth of a degree sure, or as wrong as asked for.
void believe_start(Traverse& traverse, const TraverseOptions& options) {
  constexpr double kSigma_m = 0.01, kSigma_rad = 0.01 * kRadPerDeg;
  Random random(options.seed, kStartStream);
  const double direction = random.uniform(0.0, 2.0 * std::numbers::pi),
               error_rad = options.start_error_deg * kRadPerDeg;
  const Pose& truth = traverse.T_map_body.front();
  const Eigen::AngleAxisd turn(random.uniform() < 0.5 ? error_rad : -error_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d away(std::cos(direction), std::sin(direction), 0.0);
  traverse.T_map_start =
      Pose(Eigen::Quaterniond(turn) * truth.rotation(), truth.translation() + options.start_error_m * away);
  const double sigma_m = std::hypot(kSigma_m, options.start_error_m), sigma_rad = std::hypot(kSigma_rad, error_rad);
  Vector6d variance;
  variance << kSigma_rad * kSigma_rad, kSigma_rad * kSigma_rad, sigma_rad * sigma_rad,
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  traverse.start_covariance = variance.asDiagonal();
}

/// A low sun, as at the poles.
void measure_sun(Traverse& traverse, const TraverseOptions& options) {
  constexpr double kElevation_rad = 10.0 * kRadPerDeg;
  Random random(options.seed, kSunStream);
  const double azimuth = random.uniform(0.0, 2.0 * std::numbers::pi), sigma = options.sun_sigma_deg * kRadPerDeg;
  traverse.sun_map = {std::cos(azimuth) * std::cos(kElevation_rad), std::sin(azimuth) * std::cos(kElevation_rad),
                      std::sin(kElevation_rad)};
  for (const Pose& T_map_body : traverse.T_map_body) {
    const Vector6d error = random_twist(random, sigma, 0.0);
    traverse.sun_body.push_back((T_map_body * Pose::exp(error)).rotation().conjugate() * traverse.sun_map);
  }
}

DemRaster orbital_dem(const Terrain& terrain, const Trajectory& trajectory, const TraverseOptions& options) {
  DemRaster dem = averaged_ground(terrain, trajectory, {.cell_m = options.dem.cell_m, .margin_m = kMargin});
  const auto& lengths = options.dem.noise_lengths_m;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double rms = options.dem.noise_rms_m / std::sqrt(static_cast<double>(lengths.size()));
    const std::uint64_t seed = Random::mix(Random::mix(options.seed) + kDemStream + i);
    dem = perturb(std::move(dem), {.noise_m = {rms, lengths[i], seed}});
  }
  return perturb(std::move(dem), {.bias_m = options.dem.bias_m, .shift_m = options.dem.shift_m});
}

}  // namespace

OdometryErrors OdometryErrors::times(double factor) const {
  return {factor * rotation_deg_per_sqrt_m, factor * translation_m_per_sqrt_m, factor * scale_sigma,
          factor * rotation_bias_deg_per_m};
}

Traverse make_traverse(const TraverseOptions& options) {
  Random route_random(options.seed, kRouteStream), landmark_random(options.seed, kLandmarkStream);
  const RoverOptions rover = rover_of(options, route_random);
  const Terrain terrain({.relief = options.relief, .size_m = terrain_size_m(rover, options)}, options.seed);
  Trajectory trajectory = drive(terrain, rover, Route(rover));
  if (!options.loop)
    trajectory.resize(
        std::min(trajectory.size(), static_cast<std::size_t>(options.length_m / options.keyframe_spacing_m) + 1));

  Traverse traverse;
  traverse.T_body_left = stereo_rig({}).T_body_left;
  for (const StampedPose& stamped : trajectory) {
    traverse.landmarks.push_back(
        seen_from(terrain, stamped.pose * traverse.T_body_left, options.landmarks_per_keyframe, landmark_random));
    traverse.landmarks.back().keyframe = traverse.T_map_body.size();
    traverse.T_map_body.push_back(stamped.pose);
  }
  believe_start(traverse, options);
  measure_sun(traverse, options);
  traverse.odometry = measured_motions(traverse.T_map_body, options);
  traverse.dem = orbital_dem(terrain, trajectory, options);
  return traverse;
}

}  // namespace demslam

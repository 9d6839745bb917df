#include "demslam/experiment/petal_drive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "demslam/dem/perturb.h"
#include "demslam/geometry/angle.h"
#include "demslam/sim/base_surface.h"
#include "demslam/sim/rover.h"

namespace demslam {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kMargin_m = 300.0, kPetals = 3.0;
constexpr std::array kShares = {1.0, 0.7, 1.3, 0.55, 1.15, 0.85, 1.45, 0.65};  // of the mean radius, in turn
constexpr double kFocal_px = 512.0, kBaseline_m = 0.3, kDisparitySigma_px = 0.5, kPixelSigma_px = 0.35;

enum Stream : std::uint64_t { kOdometryStream = 1, kLandmarkStream, kLoopStream, kDemStream };

DemRaster ground_raster(const DriveOptions& options) {
  TerrainOptions terrain;
  terrain.size_m = options.world_m;
  return generate_base(terrain, options.seed);
}

Vector6d random_twist(Random& random, double rotation_sigma, double translation_sigma) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? rotation_sigma : translation_sigma) * random.normal();
  return xi;
}

Matrix6d isotropic(double rotation_sigma, double translation_sigma) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(rotation_sigma), Eigen::Vector3d::Constant(translation_sigma);
  return sigma.cwiseAbs2().asDiagonal();
}

Vector4d random_systematic(const OdometryErrors& errors, Random& random) {
  Vector4d systematic;
  systematic[0] = errors.scale_sigma * random.normal();
  for (int axis = 1; axis < 4; ++axis) systematic[axis] = errors.rotation_bias_deg_per_m * kRadPerDeg * random.normal();
  return systematic;
}

/// A stereo point with the error that its own covariance states.
LandmarkPoint measured(const Eigen::Vector3d& p_left, Random& random) {
  const double disparity_px = kFocal_px * kBaseline_m / p_left.z();
  const Eigen::Vector3d along = p_left * (kDisparitySigma_px / disparity_px);
  const double across_m = p_left.z() / kFocal_px * kPixelSigma_px;
  LandmarkPoint point;
  point.p_left = p_left + along * random.normal() + across_m * Eigen::Vector3d(random.normal(), random.normal(), 0.0);
  point.covariance = along * along.transpose();
  point.covariance.topLeftCorner<2, 2>() += across_m * across_m * Eigen::Matrix2d::Identity();
  return point;
}

}  // namespace

PetalRoute::PetalRoute(double length_m, double half_size_m) {
  const double largest = *std::max_element(kShares.begin(), kShares.end());
  const double mean_m = std::min(length_m / (kPetals * kTurn), (half_size_m - kMargin_m) / (2.0 * largest));
  for (double path_m = 0.0; path_m <= length_m; path_m += kTurn * std::abs(radii_m_.back())) {
    const double radius_m = mean_m * kShares[radii_m_.size() % kShares.size()];
    radii_m_.push_back(radii_m_.size() % 2 == 0 ? radius_m : -radius_m);
  }
}

Eigen::Vector3d PetalRoute::at(double path_m) const {
  std::size_t petal = 0;
  for (; petal + 1 < radii_m_.size() && path_m >= kTurn * std::abs(radii_m_[petal]); ++petal)
    path_m -= kTurn * std::abs(radii_m_[petal]);
  const double radius_m = radii_m_[petal], heading = path_m / radius_m;
  return {radius_m * std::sin(heading), radius_m * (1.0 - std::cos(heading)), heading};
}

PetalDrive::PetalDrive(const DriveOptions& options)
    : options_(options),
      route_(options.length_m, 0.5 * options.world_m),
      T_body_left_(stereo_rig({}).T_body_left),
      odometry_random_(options.seed, kOdometryStream),
      systematic_(random_systematic(options.odometry, odometry_random_)) {
  DemRaster ground = ground_raster(options);
  measured_ = std::make_shared<Dem>(perturb(
      ground, {.noise_m = {options.noise_rms_m, options.noise_length_m, Random::mix(options.seed + kDemStream)}}));
  ground_ = std::make_shared<Dem>(std::move(ground));
}

std::size_t PetalDrive::keyframes() const {
  return static_cast<std::size_t>(std::floor(options_.length_m / options_.step_m)) + 1;
}

Pose PetalDrive::truth(std::size_t keyframe) const {
  const Eigen::Vector3d p = route_.at(static_cast<double>(keyframe) * options_.step_m);
  const DemSample ground = *ground_->sample(p.x(), p.y());
  const Eigen::Vector3d up = Eigen::Vector3d(-ground.gradient.x(), -ground.gradient.y(), 1.0).normalized();
  const Eigen::Vector3d left = up.cross(Eigen::Vector3d(std::cos(p.z()), std::sin(p.z()), 0.0)).normalized();
  Eigen::Matrix3d R;
  R << left.cross(up), left, up;
  return {R, Eigen::Vector3d(p.x(), p.y(), ground.height_m)};
}

RelativePose PetalDrive::odometry(std::size_t keyframe) {
  const Pose motion = truth(keyframe - 1).inverse() * truth(keyframe);
  const double sqrt_m = std::sqrt(motion.translation().norm());
  const double rotation_sigma = options_.odometry.rotation_deg_per_sqrt_m * kRadPerDeg * sqrt_m;
  const double translation_sigma = options_.odometry.translation_m_per_sqrt_m * sqrt_m;
  const Pose measured =
      corrected(motion, -systematic_) * Pose::exp(random_twist(odometry_random_, rotation_sigma, translation_sigma));
  return {keyframe - 1, keyframe, measured, isotropic(rotation_sigma, translation_sigma)};
}

KeyframeLandmarks PetalDrive::landmarks(std::size_t keyframe) const {
  KeyframeLandmarks seen{.keyframe = keyframe};
  if (keyframe % static_cast<std::size_t>(std::max(1.0, options_.landmarks_every_m / options_.step_m)) != 0)
    return seen;
  Random random(Random::mix(options_.seed) + keyframe, kLandmarkStream);
  const Pose T_map_left = truth(keyframe) * T_body_left_;
  const Eigen::Vector3d forward = T_map_left.rotation() * Eigen::Vector3d::UnitZ();
  const double heading = std::atan2(forward.y(), forward.x());
  for (int n = 0; n < options_.landmarks; ++n) {
    const double range_m = random.uniform(3.0, 25.0), bearing = heading + random.uniform(-0.7, 0.7);
    const double x = T_map_left.translation().x() + range_m * std::cos(bearing);
    const double y = T_map_left.translation().y() + range_m * std::sin(bearing);
    const auto height_m = ground_->height(x, y);
    if (!height_m) continue;
    const Eigen::Vector3d p_left = T_map_left.inverse() * Eigen::Vector3d(x, y, *height_m);
    if (p_left.z() > 1.0) seen.points.push_back(measured(p_left, random));
  }
  return seen;
}

Motion PetalDrive::view(std::size_t i, std::size_t j) const {
  const Pose T_i_j = truth(i).inverse() * truth(j);
  if (T_i_j.translation().norm() > options_.view_m) return {.reason = "too far apart"};
  if (std::abs(yaw_of(T_i_j.rotation())) > 40.0 * kRadPerDeg) return {.reason = "turned away"};
  Random random(Random::mix(Random::mix(options_.seed) + i) + j, kLoopStream);
  const double rotation_sigma = options_.loop_sigma_deg * kRadPerDeg;
  const Pose noise = Pose::exp(random_twist(random, rotation_sigma, options_.loop_sigma_m));
  return {.ok = true,
          .T_a_b = T_body_left_.inverse() * T_i_j * T_body_left_ * noise,
          .covariance = isotropic(rotation_sigma, options_.loop_sigma_m),
          .matches = 200,
          .inliers = 100};
}

}  // namespace demslam

#include "demslam/anchoring/sky_factors.h"

#include <gtest/gtest.h>
#include <gtsam/base/numericalDerivative.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

const Eigen::Vector3d kSun = Eigen::Vector3d(0.6, -0.7, 0.15).normalized();

Pose leaning() { return {rotation_from_rpy(0.1, -0.15, 2.0), Eigen::Vector3d(3.0, 4.0, 5.0)}; }

Eigen::Vector3d in_body(const Pose& T_map_body, const Eigen::Vector3d& direction_map) {
  return T_map_body.rotation().conjugate() * direction_map;
}

gtsam::Matrix numeric(const gtsam::NoiseModelFactor1<gtsam::Pose3>& factor, const gtsam::Pose3& at) {
  const std::function<gtsam::Vector(const gtsam::Pose3&)> error = [&](const gtsam::Pose3& T) {
    return factor.evaluateError(T);
  };
  return gtsam::numericalDerivative11<gtsam::Vector, gtsam::Pose3, 6>(error, at, 1e-6);
}

TEST(DirectionFactor, IsZeroWhereTheSunWasMeasuredAndHasItsNumericJacobianElsewhere) {
  const DirectionFactor factor(0, kSun, in_body(leaning(), kSun), gtsam::noiseModel::Isotropic::Sigma(2, 0.01));
  EXPECT_LT(factor.evaluateError(to_gtsam(leaning())).norm(), 1e-12);
  for (const double turn : {0.0, 0.2, -0.4}) {
    const gtsam::Pose3 at = to_gtsam(leaning() * Pose(rotation_from_rpy(0.05, turn, 2.0 * turn), {1.0, 0.0, 0.0}));
    gtsam::Matrix H;
    factor.evaluateError(at, H);
    EXPECT_LT((H - numeric(factor, at)).norm(), 1e-6);
  }
}

TEST(DirectionFactor, SeesAHeadingErrorButNotATurnAboutTheSunItself) {
  const DirectionFactor factor(0, kSun, in_body(leaning(), kSun), gtsam::noiseModel::Isotropic::Sigma(2, 0.01));
  const auto error_after = [&](const Eigen::Vector3d& axis) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.02, axis));
    return factor.evaluateError(to_gtsam(Pose(turn * leaning().rotation(), leaning().translation()))).norm();
  };
  EXPECT_NEAR(error_after(Eigen::Vector3d::UnitZ()), 0.02 * kSun.head<2>().norm(), 1e-4);
  EXPECT_LT(error_after(kSun), 1e-10);
}

/// Two mountains, one to the East, one to the North-West.
Skyline mountains() {
  std::vector<double> elevation;
  for (int i = 0; i < 720; ++i) {
    const double azimuth = std::numbers::pi * i / 360.0;
    elevation.push_back(0.10 * std::exp(-8.0 * (1.0 - std::cos(azimuth))) +
                        0.06 * std::exp(-20.0 * (1.0 - std::cos(azimuth - 2.3))));
  }
  return Skyline(elevation);
}

std::vector<Eigen::Vector3d> horizon_from(const Skyline& skyline, const Pose& T_map_body) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = -40; i <= 40; ++i) {
    const double azimuth = yaw_of(T_map_body.rotation()) + 0.015 * i, elevation = skyline.elevation(azimuth);
    directions.push_back(in_body(T_map_body, {std::cos(azimuth) * std::cos(elevation),
                                              std::sin(azimuth) * std::cos(elevation), std::sin(elevation)}));
  }
  return directions;
}

TEST(SkylineFactor, IsZeroInTheAttitudeThatSawTheHorizonAndHasItsNumericJacobianElsewhere) {
  const auto skyline = std::make_shared<Skyline>(mountains());
  const auto directions = horizon_from(*skyline, leaning());
  const SkylineFactor factor(0, skyline, directions, skyline_noise(directions.size(), 1e-3, 5.0, 2.5));
  EXPECT_LT(factor.evaluateError(to_gtsam(leaning())).norm(), 1e-9);
  const gtsam::Pose3 at = to_gtsam(leaning() * Pose(rotation_from_rpy(0.01, -0.02, 0.0123), {0.0, 0.0, 0.0}));
  gtsam::Matrix H;
  factor.evaluateError(at, H);
  EXPECT_LT((H - numeric(factor, at)).norm(), 1e-2 * H.norm());  // rows that change their sample within the step
}

TEST(SkylineFactor, FindsTheHeadingAgainFromTwoDegreesOff) {
  const auto skyline = std::make_shared<Skyline>(mountains());
  const Pose truth(rotation_from_rpy(0.02, 0.03, 0.1), Eigen::Vector3d::Zero());
  const auto directions = horizon_from(*skyline, truth);
  const SkylineFactor factor(0, skyline, directions, skyline_noise(directions.size(), 1e-3, 5.0, 2.5));
  Pose estimate = truth * Pose(rotation_from_rpy(0.0, 0.0, 0.035), Eigen::Vector3d::Zero());
  for (int i = 0; i < 10; ++i) {
    gtsam::Matrix H;
    const gtsam::Vector r = factor.evaluateError(to_gtsam(estimate), H);
    const Matrix6d hessian = H.transpose() * H + 1e-9 * Matrix6d::Identity();
    estimate = estimate * Pose::exp(-hessian.ldlt().solve(H.transpose() * r));
  }
  EXPECT_NEAR(yaw_of(estimate.rotation()), 0.1, 1e-4);
}

TEST(Skyline, OfAConeHasItsSlopeAndFarGroundSinks) {
  DemRaster dem{.rows = 200, .cols = 200, .cell_m = 10.0, .west_m = -1000.0, .north_m = 1000.0};
  for (int row = 0; row < 200; ++row) {
    for (int col = 0; col < 200; ++col) dem.heights.push_back(static_cast<float>(0.1 * dem.centre(row, col).norm()));
  }
  const Dem cone(dem);
  const Skyline flat = skyline_from(cone, Eigen::Vector3d::Zero(), {.azimuths = 36, .radius_m = 0.0});
  for (const double azimuth : {0.0, 1.0, 4.0}) EXPECT_NEAR(flat.elevation(azimuth), std::atan(0.1), 1e-3);
  const Skyline round =
      skyline_from(cone, Eigen::Vector3d::Zero(), {.azimuths = 36, .min_range_m = 900.0, .radius_m = 1e4});
  EXPECT_NEAR(round.elevation(0.0), std::atan(0.1 - 900.0 / 2e4), 1e-3);
  EXPECT_LT(flat.roughness(), 1e-3);
}

}  // namespace
}  // namespace demslam

#include "demslam/odometry/dead_reckoning.h"

#include <gtest/gtest.h>

#include <numbers>

namespace demslam {
namespace {

constexpr TimestampNs kSecond = 1'000'000'000;
const Pose kT_body_left(R_body_camera_level(), {0.5, 0.1, 1.2});

/// A circle to the left: 0.4 m/s, 3 degrees per second.
constexpr double kSpeed = 0.4, kTurn = 3.0 * std::numbers::pi / 180.0;

Vector6d body_twist() {
  Vector6d twist = Vector6d::Zero();
  twist[2] = kTurn;
  twist[3] = kSpeed;
  return twist;
}

MotionSensors sensors() {
  MotionSensors result;
  for (int i = 0; i <= 2000; ++i) result.imu.push_back({i * kSecond / 100, {0.0, 0.0, kTurn}, {}});
  for (int i = 0; i <= 200; ++i) {
    const double rolled = kSpeed * i / 10.0;
    result.wheels.push_back({i * kSecond / 10, rolled - 0.1, rolled + 0.1});
  }
  return result;
}

Pose truth(double seconds) { return kT_body_left.inverse() * Pose::exp(body_twist() * seconds) * kT_body_left; }

double sigma_m(const ReckonedStep& step) { return std::sqrt(step.covariance.diagonal().tail<3>().mean()); }

TEST(DeadReckoning, LetsTheLastVelocityGoOnWithoutSensors) {
  const Vector6d twist = kT_body_left.inverse().adjoint() * body_twist();
  const ReckonedStep step = DeadReckoning({}, kT_body_left).step(kSecond, 4 * kSecond, twist);
  EXPECT_LT((step.T_from_to.matrix() - truth(3.0).matrix()).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(sigma_m(step), 1.5);
}

TEST(DeadReckoning, WheelsAndGyroFollowATurnThatTheLastVelocityKnowsNothingOf) {
  DeadReckoning reckoning({}, kT_body_left);
  reckoning.set_sensors(sensors());
  const ReckonedStep step = reckoning.step(kSecond / 2, 10 * kSecond + kSecond / 2, Vector6d::Zero());
  EXPECT_LT((step.T_from_to.translation() - truth(10.0).translation()).norm(), 0.01);
  EXPECT_LT((truth(10.0).inverse() * step.T_from_to).log().head<3>().norm(), 1e-3);
  EXPECT_LT(sigma_m(step), 0.3);  // of 4 m
}

ReckonedStep seen(const Eigen::Vector3d& translation_m, const Eigen::Vector3d& sigma_m) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(1e-3), sigma_m;
  return {Pose(Eigen::Quaterniond::Identity(), translation_m), sigma.cwiseAbs2().asDiagonal()};
}

TEST(Supported, BelievesCamerasThatSeeWell) {
  const ReckonedStep cameras = seen({0.0, 0.0, 1.0}, Eigen::Vector3d::Constant(0.02)),
                     wheels = seen({0.0, 0.0, 1.5}, Eigen::Vector3d::Constant(0.1));  // they slip
  const ReckonedStep both = supported(cameras, wheels);
  EXPECT_EQ(both.T_from_to.translation(), cameras.T_from_to.translation());
  EXPECT_EQ(both.covariance, cameras.covariance);
}

TEST(Supported, FillsInTheDirectionThatCamerasDoNotSee) {
  const ReckonedStep cameras = seen({0.0, 0.0, 1.8}, {0.01, 0.01, 1.0}),
                     wheels = seen({0.05, 0.0, 1.0}, Eigen::Vector3d::Constant(0.1));
  const ReckonedStep both = supported(cameras, wheels);
  EXPECT_NEAR(both.T_from_to.translation().z(), 1.0, 0.02);  // the wheels'
  EXPECT_NEAR(both.T_from_to.translation().x(), 0.0, 0.01);  // the cameras'
  EXPECT_NEAR(std::sqrt(both.covariance(5, 5)), 0.1, 0.01);
  EXPECT_NEAR(std::sqrt(both.covariance(3, 3)), 0.01, 0.001);
}

TEST(Supported, WidensWeakCamerasThatContradict) {
  const ReckonedStep cameras = seen({0.0, 0.0, -6.0}, {0.2, 0.2, 1.2}),
                     wheels = seen({0.0, 0.0, 1.0}, Eigen::Vector3d::Constant(0.1));
  const ReckonedStep both = supported(cameras, wheels);
  EXPECT_NEAR(both.T_from_to.translation().z(), 1.0, 0.05);
  const double chi_square = 49.0 / (1.44 + 0.01);
  EXPECT_NEAR(1.0 / both.covariance(5, 5), 1.0 / 0.01 + 1.0 / (1.44 * chi_square / 6.0), 1e-6);
}

TEST(DeadReckoning, EachSensorCanBeSwitchedOff) {
  DeadReckoning no_wheels({.use_wheels = false}, kT_body_left),
      none({.use_imu = false, .use_wheels = false}, kT_body_left);
  no_wheels.set_sensors(sensors());
  none.set_sensors(sensors());
  const ReckonedStep turned = no_wheels.step(0, 10 * kSecond, Vector6d::Zero());
  EXPECT_NEAR(turned.T_from_to.log().head<3>().norm(), 10.0 * kTurn, 1e-3);
  EXPECT_GT(sigma_m(turned), 4.9);
  EXPECT_LT(none.step(0, 10 * kSecond, Vector6d::Zero()).T_from_to.log().norm(), 1e-12);
}

TEST(DeadReckoning, SensorsThatEndTooEarlyAreNotUsed) {
  DeadReckoning reckoning({}, kT_body_left);
  reckoning.set_sensors(sensors());
  EXPECT_GT(sigma_m(reckoning.step(15 * kSecond, 25 * kSecond, Vector6d::Zero())), 4.9);
}

}  // namespace
}  // namespace demslam

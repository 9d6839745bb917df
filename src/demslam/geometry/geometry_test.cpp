#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/geometry/camera.h"
#include "demslam/geometry/trajectory.h"

namespace demslam {
namespace {

Vector6d random_twist(Random& random) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.normal();
  return xi;
}

TEST(Pose, ComposesAsItMapsPoints) {
  Random random(1);
  const Pose T_a_b = Pose::exp(random_twist(random)), T_b_c = Pose::exp(random_twist(random));
  const Eigen::Vector3d p_c(1.0, 2.0, 3.0);
  EXPECT_TRUE(((T_a_b * T_b_c) * p_c).isApprox(T_a_b * (T_b_c * p_c), 1e-12));
}

TEST(Pose, InverseUndoes) {
  Random random(2);
  const Pose T = Pose::exp(random_twist(random));
  EXPECT_LT((T * T.inverse()).log().norm(), 1e-12);
}

TEST(Pose, LogInvertsExpFromTinyToLargeAngles) {
  Random random(3);
  for (const double scale : {1e-9, 1e-5, 1e-2, 0.5}) {
    const Vector6d xi = scale * random_twist(random);
    EXPECT_LT((Pose::exp(xi).log() - xi).norm(), 1e-10 * (1.0 + xi.norm())) << scale;
  }
}

TEST(Pose, TangentIsRotationFirstAndPerturbsOnTheRight) {
  Vector6d xi = Vector6d::Zero();
  xi[5] = 2.0;  // v_z
  const Pose T_map_body(rotation_from_rpy(0.0, std::numbers::pi / 2, 0.0), Eigen::Vector3d::Zero());
  // The body's z axis points along the map's x axis after a 90 degree pitch.
  EXPECT_TRUE((T_map_body * Pose::exp(xi)).translation().isApprox(Eigen::Vector3d(2.0, 0.0, 0.0), 1e-12));
}

TEST(Pose, AdjointMovesAPerturbationAcross) {
  Random random(4);
  const Pose T = Pose::exp(random_twist(random));
  const Vector6d xi = 1e-3 * random_twist(random);
  EXPECT_LT(((Pose::exp(T.adjoint() * xi) * T).inverse() * (T * Pose::exp(xi))).log().norm(), 1e-12);
}

TEST(Pose, PositivePitchLowersTheNose) {
  const Eigen::Vector3d nose = rotation_from_rpy(0.0, 0.1, 0.0) * Eigen::Vector3d::UnitX();
  EXPECT_LT(nose.z(), 0.0);
}

TEST(Pose, LevelCameraLooksForward) {
  EXPECT_TRUE((R_body_camera_level() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX(), 1e-12));
  EXPECT_TRUE((R_body_camera_level() * Eigen::Vector3d::UnitX()).isApprox(-Eigen::Vector3d::UnitY(), 1e-12));
}

TEST(Pose, YawTurnsFromEastToNorth) { EXPECT_NEAR(yaw_of(rotation_from_rpy(0.2, 0.1, 0.5)), 0.5, 1e-12); }

TEST(RectifiedRig, ProjectsWhatItUnprojects) {
  RectifiedRig rig{.width = 640, .height = 480, .focal_px = 400.0, .cx = 320.0, .cy = 240.0, .baseline_m = 0.3};
  const Eigen::Vector2d pixel(100.25, 300.5);
  const Eigen::Vector3d p_left = rig.unproject(pixel, 6.0);
  EXPECT_NEAR(p_left.z(), 400.0 * 0.3 / 6.0, 1e-12);
  EXPECT_TRUE(rig.project(p_left).isApprox(pixel, 1e-12));
}

TEST(RectifiedRig, AddsItsVergenceToDisparities) {
  RectifiedRig rig{.width = 640, .height = 480, .focal_px = 400.0, .cx = 320.0, .cy = 240.0, .baseline_m = 0.3};
  rig.vergence_rad = 1e-3;
  const Eigen::Vector3d p_left(0.15, 1.0, 8.0);
  // Seen by a right camera that has turned about its y axis.
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(rig.vergence_rad, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d p_right = turn.conjugate() * (p_left - Eigen::Vector3d(rig.baseline_m, 0.0, 0.0));
  const double measured_px = rig.project(p_left).x() - rig.project(p_right).x();
  EXPECT_NEAR(measured_px, rig.disparity_px(8.0) + rig.vergence_px(), 1e-3);
  EXPECT_DOUBLE_EQ(rig.vergence_px(), 0.4);
  EXPECT_TRUE(rig.unproject(rig.project(p_left), measured_px).isApprox(p_left, 1e-3));
}

TEST(CheckRig, RefusesZeroBaselineAndZeroFocalLength) {
  Camera camera{.width = 640, .height = 480, .fx = 400.0, .fy = 400.0, .cx = 320.0, .cy = 240.0};
  StereoRig rig{.left = camera, .right = camera};
  EXPECT_THAT([&] { check_rig(rig, "c.toml"); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("baseline must be positive")));
  rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.0});
  EXPECT_NO_THROW(check_rig(rig, "c.toml"));
  rig.left.fx = 0.0;
  EXPECT_THAT([&] { check_rig(rig, "c.toml"); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("focal length must be positive")));
}

TEST(Trajectory, LengthIsTheSumOfTheSteps) {
  Trajectory path(3);
  path[1].pose = Pose(Eigen::Quaterniond::Identity(), {3.0, 4.0, 0.0});
  path[2].pose = Pose(Eigen::Quaterniond::Identity(), {3.0, 4.0, 2.0});
  EXPECT_DOUBLE_EQ(path_length_m(path), 7.0);
}

}  // namespace
}  // namespace demslam

#include "demslam/evaluation/lusnar_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

namespace demslam {
namespace {

/// A rover at (1, 2, z) that looks along the world's x, nose 0.1 rad up.
Trajectory rover(const Eigen::Matrix3d& R_world_level, double z) {
  const Eigen::Matrix3d R_level_rover = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return {{0, Pose(Eigen::Matrix3d(R_world_level * R_level_rover), {1.0, 2.0, z})}};
}

TEST(LusnarTruth, AWorldThatPointsDownIsTurned) {
  const Trajectory truth = rover(Eigen::Matrix3d::Identity(), -3.0);  // north-east-down like
  EXPECT_EQ(lusnar_world_z(truth), WorldZ::down);
  const Pose T = lusnar_T_map_body(truth).front().pose;
  EXPECT_TRUE(T.translation().isApprox(Eigen::Vector3d(1.0, -2.0, 3.0)));
  EXPECT_NEAR((T.rotation() * Eigen::Vector3d::UnitX()).z(), std::sin(0.1), 1e-12) << "the nose is up";
  EXPECT_NEAR((T.rotation() * Eigen::Vector3d::UnitZ()).z(), std::cos(0.1), 1e-12);
}

TEST(LusnarTruth, AWorldThatPointsUpStays) {
  const Trajectory truth = rover(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(), 3.0);
  EXPECT_EQ(lusnar_world_z(truth), WorldZ::up);
  const Pose T = lusnar_T_map_body(truth).front().pose;
  EXPECT_TRUE(T.translation().isApprox(Eigen::Vector3d(1.0, 2.0, 3.0)));
  EXPECT_NEAR((T.rotation() * Eigen::Vector3d::UnitX()).z(), std::sin(0.1), 1e-12);
  EXPECT_TRUE((T.rotation() * Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d::UnitY(), 1e-12)) << "left is north";
}

TEST(LusnarTruth, ACalibrationMakesItOurOwnLayout) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "LusnarTruth";
  std::filesystem::create_directories(folder / "image1");
  EXPECT_TRUE(is_lusnar_truth(folder / "gt.txt"));
  EXPECT_FALSE(is_lusnar_truth(folder / "other.txt"));
  std::ofstream(folder / "calibration.toml") << "\n";
  EXPECT_FALSE(is_lusnar_truth(folder / "gt.txt"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace demslam

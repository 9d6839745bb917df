#include "demslam/dataset/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

void expect_refused(const std::string& toml, const std::string& message) {
  const TestFolder folder;
  const auto file = folder.text("calibration.toml", toml);
  EXPECT_THAT([&] { read_calibration(file); }, ThrowsMessage<Error>(HasSubstr(message))) << toml;
}

TEST(Calibration, TheRowOffsetLowersTheRightImage) {
  const TestFolder folder;
  const auto file = folder.text("c.toml", "row_offset_px = 3.2\n" + test::small_calibration_toml());
  const StereoRig rig = read_calibration_toml(file);
  EXPECT_DOUBLE_EQ(rig.right.cy, rig.left.cy + 3.2);
  EXPECT_DOUBLE_EQ(rig.right.fx, 4.0);
  EXPECT_TRUE(rig.T_left_right.translation().isApprox(Eigen::Vector3d(0.3, 0.0, 0.0)));
}

TEST(Calibration, AnUnknownMountingIsALevelCameraAtTheBodysOrigin) {
  const TestFolder folder;
  const StereoRig rig = read_calibration_toml(folder.text("c.toml", test::small_calibration_toml()));
  EXPECT_TRUE((rig.T_body_left * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_TRUE((rig.T_body_left * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitZ()));
}

TEST(Calibration, ReadsBackWhatItWrites) {
  StereoRig rig;
  rig.left = {.width = 640,
              .height = 480,
              .fx = 400.1,
              .fy = 401.2,
              .cx = 320.3,
              .cy = 240.4,
              .distortion = Distortion::radtan,
              .coefficients = {-0.3, 0.1, 1e-4, -2e-5, 0.01}};
  rig.right = rig.left;
  rig.right.distortion = Distortion::equidistant;
  rig.right.coefficients = {0.1, 0.2, 0.3, 0.4, 0.0};
  rig.T_left_right = Pose(rotation_from_rpy(0.01, -0.02, 0.03), {0.31, 0.001, -0.002});
  rig.T_body_left = Pose(rotation_from_rpy(0.1, 0.2, 0.3), {1.0, 0.155, 1.5});
  rig.p_body_ground = {0.1, 0.2, -1.5};

  const TestFolder folder;
  const StereoRig read = read_calibration_toml(folder.text("c.toml", calibration_toml(rig)));
  EXPECT_EQ(read.right.distortion, Distortion::equidistant);
  EXPECT_EQ(read.left.coefficients, rig.left.coefficients);
  EXPECT_EQ(read.right.coefficients, rig.right.coefficients);
  EXPECT_EQ(read.left.fy, rig.left.fy);
  EXPECT_EQ(read.right.width, 640);
  EXPECT_TRUE(read.T_left_right.matrix().isApprox(rig.T_left_right.matrix(), 1e-12));
  EXPECT_TRUE(read.T_body_left.matrix().isApprox(rig.T_body_left.matrix(), 1e-12));
  EXPECT_TRUE(read.p_body_ground.isApprox(rig.p_body_ground, 1e-15));
}

TEST(Calibration, RefusesWhatCannotBeReal) {
  const std::string good = test::small_calibration_toml();
  expect_refused("baseline_m = 0.0\n" + good.substr(good.find('[')), "the baseline must be positive");
  expect_refused("baseline_m = 0.3\n[left]\nwidth = 8\nheight = 6\nfx = 0.0\nfy = 4.0\ncx = 3.5\ncy = 2.5\n",
                 "focal length must be positive");
  expect_refused(good.substr(good.find('[')), "give either 'baseline_m' or 'T_left_right'");
  expect_refused("baseline_m = 0.3\n", "key 'left' is missing");
  expect_refused("baseline_m = 0.3\n[left]\nwidth = 8\n", "calibration.toml:2: key 'left.height' is missing");
}

TEST(Calibration, RefusesUnknownKeysAndDistortionsWithTheirLine) {
  const std::string good = test::small_calibration_toml();
  expect_refused("basline_m = 0.3\n" + good, "calibration.toml:1: unknown key 'basline_m'; did you mean 'baseline_m'?");
  expect_refused(good + "distortion = \"fov\"\n", "calibration.toml:9: unknown distortion 'fov'");
  expect_refused(good + "coefficients = [0.1]\n", "distortion 'none' takes at most 0 coefficients");
  expect_refused("frame_rate_hz = 0\n" + good, "'frame_rate_hz' must be positive");
}

TEST(Calibration, TheRoverSandboxFileIsSound) {
  const Calibration calibration =
      read_calibration(std::filesystem::path(DEMSLAM_SOURCE_DIR) / "configs/rover_sandbox.toml");
  EXPECT_DOUBLE_EQ(calibration.rig.T_left_right.translation().x(), 0.0726);
  EXPECT_DOUBLE_EQ(calibration.frame_rate_hz.value(), 1.0);
}

}  // namespace
}  // namespace demslam

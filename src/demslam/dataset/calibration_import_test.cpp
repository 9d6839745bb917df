#include "demslam/dataset/calibration_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

Calibration imported(const std::string& yaml) {
  const TestFolder folder;
  return read_calibration(folder.text("c.yaml", yaml));
}

TEST(CalibrationImport, KalibrsTransformsAreTurnedAround) {
  const std::string camera =
      "  camera_model: pinhole\n  intrinsics: [400, 401, 320, 240]\n  resolution: [640, 480]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.3, 0.1, 0.001, 0.002]\n";
  // Camera 1 is turned by 90 degrees about z: a point at camera 0's +x lies at camera 1's -y.
  const StereoRig rig = imported("cam0:\n" + camera +
                                 "cam1:\n  T_cn_cnm1:\n  - [0, 1, 0, 0]\n  - [-1, 0, 0, 0.2]\n  - [0, 0, 1, 0]\n"
                                 "  - [0, 0, 0, 1]\n" +
                                 camera)
                            .rig;
  EXPECT_TRUE(rig.T_left_right.translation().isApprox(Eigen::Vector3d(0.2, 0.0, 0.0), 1e-12));
  EXPECT_EQ(rig.left.distortion, Distortion::radtan);
  EXPECT_DOUBLE_EQ(rig.right.coefficients[3], 0.002);
  EXPECT_DOUBLE_EQ(rig.left.fy, 401.0);
}

const std::string kOrbCameras =
    "Camera1.fx: 190.9\nCamera1.fy: 190.8\nCamera1.cx: 254.9\nCamera1.cy: 256.8\nCamera1.k1: 0.0034\nCamera1.k2: "
    "0.0007\n"
    "Camera2.fx: 190.4\nCamera2.fy: 190.4\nCamera2.cx: 252.5\nCamera2.cy: 254.9\nCamera2.k1: 0.003\nCamera2.k4: 0.5\n"
    "Camera.width: 512\nCamera.height: 512\nCamera.fps: 20\nStereo.b: 0.07\n"
    "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n"
    "  data: [1, 0, 0, 0.101, 0, 1, 0, 0.002, 0, 0, 1, 0.001, 0, 0, 0, 1.000000]\n";

TEST(CalibrationImport, OrbSlamFisheye) {
  const Calibration calibration = imported("%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\n" + kOrbCameras);
  EXPECT_EQ(calibration.rig.right.distortion, Distortion::equidistant);
  EXPECT_DOUBLE_EQ(calibration.rig.left.coefficients[1], 0.0007);
  EXPECT_DOUBLE_EQ(calibration.rig.right.coefficients[3], 0.5);
  EXPECT_DOUBLE_EQ(calibration.rig.T_left_right.translation().x(), 0.101);
  EXPECT_DOUBLE_EQ(*calibration.frame_rate_hz, 20.0);
}

TEST(CalibrationImport, OrbSlamRectified) {
  const StereoRig rig = imported("Camera.type: \"Rectified\"\n" + kOrbCameras).rig;
  EXPECT_EQ(rig.right.distortion, Distortion::none);
  EXPECT_DOUBLE_EQ(rig.right.fx, rig.left.fx);
  EXPECT_DOUBLE_EQ(rig.T_left_right.translation().x(), 0.07);
}

TEST(CalibrationImport, OrbSlamOfOldWithBf) {
  const StereoRig rig = imported(
                            "Camera.fx: 500\nCamera.fy: 500\nCamera.cx: 320\nCamera.cy: 240\nCamera.width: "
                            "640\nCamera.height: 480\nCamera.bf: 100\n")
                            .rig;
  EXPECT_DOUBLE_EQ(rig.T_left_right.translation().x(), 0.2);
}

/// A pair whose raw cameras are both turned by 90 degrees about the optical axis: raw x is rectified -y.
const std::string kQuarterTurn = "[0, -1, 0, 1, 0, 0, 0, 0, 1]";

TEST(CalibrationImport, StellaWithRectifierDescribesTheRawCameras) {
  const std::string camera =
      "Camera:\n  name: c\n  setup: stereo\n  model: perspective\n  fx: 435.2\n  fy: 435.2\n  cx: 367.2\n  cy: 252.2\n"
      "  fps: 20.0\n  cols: 752\n  rows: 480\n  focal_x_baseline: 43.52\n";
  EXPECT_NEAR(imported(camera).rig.T_left_right.translation().x(), 0.1, 1e-12);
  const StereoRig rig = imported(camera +
                                 "StereoRectifier:\n  K_left: [458, 0, 367, 0, 457, 248, 0, 0, 1]\n"
                                 "  D_left: [-0.28, 0.07, 0.0002, 0.00002, 0.0]\n  R_left: " +
                                 kQuarterTurn +
                                 "\n  K_right: [457, 0, 379, 0, 456, 255, 0, 0, 1]\n  D_right: [-0.28, 0.07, -0.0001, "
                                 "-0.00004, 0.0]\n  R_right: " +
                                 kQuarterTurn + "\n")
                            .rig;
  EXPECT_DOUBLE_EQ(rig.left.fx, 458.0);
  EXPECT_DOUBLE_EQ(rig.right.coefficients[2], -0.0001);
  EXPECT_TRUE(rig.T_left_right.rotation_matrix().isIdentity(1e-12));
  EXPECT_TRUE(rig.T_left_right.translation().isApprox(Eigen::Vector3d(0.0, -0.1, 0.0), 1e-12));
}

TEST(CalibrationImport, OrbSlamOfOldWithRectificationIsTheSamePair) {
  const auto matrix = [](int cols, const std::string& data) {
    return " !!opencv-matrix\n   rows: 3\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: " + data + "\n";
  };
  const std::string K = matrix(3, "[458, 0, 367, 0, 457, 248, 0, 0, 1]"),
                    D = matrix(5, "[-0.28, 0.07, 0.0002, 0.00002, 0]");
  const StereoRig rig =
      imported(
          "%YAML:1.0\nCamera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.2\nCamera.cy: 252.2\nCamera.width: 752\n"
          "Camera.height: 480\nCamera.bf: 43.52\nLEFT.K:" +
          K + "LEFT.D:" + D + "LEFT.R:" + matrix(3, kQuarterTurn) + "RIGHT.K:" + K + "RIGHT.D:" + D +
          "RIGHT.R:" + matrix(3, kQuarterTurn))
          .rig;
  EXPECT_EQ(rig.left.distortion, Distortion::radtan);
  EXPECT_TRUE(rig.T_left_right.translation().isApprox(Eigen::Vector3d(0.0, -0.1, 0.0), 1e-12));
}

TEST(CalibrationImport, WhatCannotBeReadIsRefusedWithItsLine) {
  EXPECT_THAT([] { imported("%YAML:1.0\nfoo: 1\n"); },
              ThrowsMessage<Error>(HasSubstr("no stereo calibration that is known")));
  EXPECT_THAT([] { imported("Camera.type: \"Spherical\"\n" + kOrbCameras); },
              ThrowsMessage<Error>(HasSubstr("c.yaml:1: unknown Camera.type 'Spherical'")));
  EXPECT_THAT([] { imported("cam0:\n  camera_model: omni\ncam1:\n  camera_model: omni\n"); },
              ThrowsMessage<Error>(HasSubstr("c.yaml:2: unknown camera model 'omni'")));
  EXPECT_THAT([] { imported("Camera.type: \"PinHole\"\nCamera1.fx: 3\nCamera.width: 2\nCamera.height: 2\n"); },
              ThrowsMessage<Error>(HasSubstr("key 'Camera1.fy' is missing")));
}

}  // namespace
}  // namespace demslam

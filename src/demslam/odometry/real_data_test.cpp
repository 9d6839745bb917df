#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "demslam/image/rectify.h"
#include "demslam/odometry/odometry.h"
#include "demslam/odometry/patch_align.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(DEMSLAM_SHARED_DIR) / "data";

std::vector<fs::path> sorted_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".png" || entry.path().extension() == ".jpg") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

StereoRig kitti_rig() {
  const Camera camera{.width = 1226, .height = 370, .fx = 707.0912, .fy = 707.0912, .cx = 601.8873, .cy = 183.1104};
  return {.left = camera,
          .right = camera,
          .T_left_right = Pose(Eigen::Quaterniond::Identity(), {379.8145 / 707.0912, 0.0, 0.0})};
}

StereoRig rover_rig() {
  Camera camera{.width = 512, .height = 288, .fx = 257.69, .fy = 257.69, .cx = 261.98, .cy = 141.07};
  StereoRig rig{
      .left = camera, .right = camera, .T_left_right = Pose(Eigen::Quaterniond::Identity(), {0.0726, 0.0, 0.0})};
  rig.right.cy += 3.2;
  return rig;
}

/// EuRoC V1_01, from its sensor.yaml files.
StereoRig euroc_rig() {
  StereoRig rig;
  rig.left = {.width = 752,
              .height = 480,
              .fx = 458.654,
              .fy = 457.296,
              .cx = 367.215,
              .cy = 248.375,
              .distortion = Distortion::radtan,
              .coefficients = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0}};
  rig.right = {.width = 752,
               .height = 480,
               .fx = 457.587,
               .fy = 456.134,
               .cx = 379.999,
               .cy = 255.238,
               .distortion = Distortion::radtan,
               .coefficients = {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05, 0.0}};
  Eigen::Matrix3d R_body_left, R_body_right;
  R_body_left << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247, 0.025715529948,
      -0.0257744366974, 0.00375618835797, 0.999660727178;
  R_body_right << 0.0125552670891, -0.999755099723, 0.0182237714554, 0.999598781151, 0.0130119051815, 0.0251588363115,
      -0.0253898008918, 0.0179005838253, 0.999517347078;
  rig.T_body_left = Pose(R_body_left, {-0.0216401454975, -0.064676986768, 0.00981073058949});
  const Pose T_body_right(R_body_right, {-0.0198435579556, 0.0453689425024, 0.00786212447038});
  rig.T_left_right = rig.T_body_left.inverse() * T_body_right;
  return rig;
}

/// Poses of every frame in the first one, by chaining keyframes.
struct Track {
  std::vector<Pose> T_first_left;
  int bridged = 0;
};

Track drive(const StereoRig& rig, const fs::path& left, const fs::path& right, double rate_hz, std::size_t frames) {
  const Rectifier rectifier(rig);
  StereoOdometry odometry(rectifier.rig(), make_frontend({}), {});
  const auto left_files = sorted_files(left), right_files = sorted_files(right);
  Track run;
  std::vector<Pose> keyframes;
  for (std::size_t i = 0; i < std::min(frames, left_files.size()); ++i) {
    const auto t_ns = static_cast<TimestampNs>(1e9 * static_cast<double>(i) / rate_hz);
    const OdometryResult result =
        odometry.process(t_ns, rectifier.left(read_image(left_files[i])), rectifier.right(read_image(right_files[i])));
    const Pose pose = keyframes.empty() ? Pose() : keyframes.at(result.reference_keyframe) * result.T_reference_left;
    if (result.is_keyframe) keyframes.push_back(pose);
    run.T_first_left.push_back(pose);
    run.bridged += result.status == Tracking::bridged ? 1 : 0;
  }
  return run;
}

std::vector<Eigen::Vector3d> kitti_truth(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<Eigen::Vector3d> positions;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream numbers(line);
    double m[12] = {};
    for (double& value : m) numbers >> value;
    positions.emplace_back(m[3], m[7], m[11]);
  }
  return positions;
}

TEST(RealData, KittiEndsNearItsTruth) {
  const fs::path folder = kData / "kitti_seq1";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const Track run = drive(kitti_rig(), folder / "image_l", folder / "image_r", 10.0, 51);
  const auto truth = kitti_truth(folder / "poses.txt");
  ASSERT_EQ(run.T_first_left.size(), truth.size());
  EXPECT_EQ(run.bridged, 0);
  EXPECT_LT((run.T_first_left.back().translation() - truth.back()).norm(), 0.012 * 59.86);
}

TEST(RealData, EurocAtRestStaysAtRest) {
  const fs::path folder = kData / "euroc_v101_short" / "mav0";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const Track run = drive(euroc_rig(), folder / "cam0" / "data", folder / "cam1" / "data", 20.0, 20);
  EXPECT_EQ(run.bridged, 0);
  for (const Pose& pose : run.T_first_left) EXPECT_LT(pose.translation().norm(), 0.005);
}

TEST(RealData, RoverLosesNoFrame) {
  const fs::path folder = kData / "rover_sandbox";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const Track run = drive(rover_rig(), folder / "left", folder / "right", 1.0, 60);
  EXPECT_EQ(run.bridged, 0);
}

TEST(Rectifier, AlignsTheRowsOfARealPair) {
  const fs::path folder = kData / "euroc_v101_short" / "mav0";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const Rectifier rectifier(euroc_rig());
  const Image left = rectifier.left(read_image(sorted_files(folder / "cam0" / "data").front()));
  const Image right = rectifier.right(read_image(sorted_files(folder / "cam1" / "data").front()));
  const StereoFeatures features =
      match_stereo(rectifier.rig(), make_frontend({}).extractor->extract(left), left, right, {});
  std::vector<float> offsets;
  for (std::size_t i = 0; i < features.left.size(); ++i) {
    if (!features.has_depth(i)) continue;
    const Eigen::Vector2f pixel = features.left.keypoints[i];
    const Eigen::Vector2f guess = pixel - Eigen::Vector2f(features.disparity_px[i], 0.0F);
    Eigen::Matrix3f shift = Eigen::Matrix3f::Identity();
    shift.topRightCorner<2, 1>() = pixel;
    const auto there = align_pixel(left, right, guess, shift);
    if (there && there->correlation > 0.9F) offsets.push_back(std::abs(there->pixel.y() - pixel.y()));
  }
  ASSERT_GT(offsets.size(), 300U);
  std::ranges::nth_element(offsets, offsets.begin() + offsets.size() / 2);
  EXPECT_LT(offsets[offsets.size() / 2], 0.15F);  // median |row offset|, pixels
}

}  // namespace
}  // namespace demslam

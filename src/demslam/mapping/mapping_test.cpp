#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "demslam/base/error.h"
#include "demslam/mapping/build_dem.h"
#include "demslam/mapping/start_from.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class Mapping : public testing::Test {
 protected:
  Mapping() { fs::create_directories(folder_ / "LiDAR"); }
  ~Mapping() override { fs::remove_all(folder_); }

  void text(const std::string& name, const std::string& content) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << content;
  }
  /// Two scans of flat ground, 2 m below sensors at (0, 0, 2) and (1, 0, 2); one rock of 1 m.
  void write_scans() const {
    for (const char* stem : {"1000000000", "1500000000"}) {
      std::string scan;
      for (double x = -3.75; x < 4.0; x += 0.5) {
        for (double y = -3.75; y < 4.0; y += 0.5) {
          const bool rock = x == 0.25 && y == 0.25;
          scan += std::to_string(x) + "," + std::to_string(y) + "," + (rock ? "-1.0,174\n" : "-2.0,-1\n");
        }
      }
      text(std::string("LiDAR/") + stem + ".txt", scan);
    }
    text("LiDAR/timestamp.txt", "1000000040,0,0,2,1,0,0,0\n1500000040,1,0,2,1,0,0,0\n");
  }
  BuildDemInputs lidar() const {
    return {.kind = CloudKind::lidar, .source = folder_, .poses = folder_ / "LiDAR/timestamp.txt"};
  }

  const fs::path folder_ = fs::path(testing::TempDir()) /
                           (std::string("Mapping.") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Mapping, LidarScansAreRasteredAtTheSensorsPoses) {
  write_scans();
  const DemBuildReport report = build_dem(lidar(), {.cell_m = 1.0}, {});
  EXPECT_EQ(report.scans, 2U);
  EXPECT_FALSE(report.world_z_down);
  EXPECT_DOUBLE_EQ(report.dem.heights.west_m, -4.0);
  EXPECT_EQ(report.dem.heights.cols, 9);
  EXPECT_NEAR(Dem(report.dem.heights).height(2.5, 2.5).value(), 0.0, 1e-6);
  EXPECT_GT(report.dem.heights.at(3, 4), 0.05F) << "the rock";
  BuildDemInputs bare = lidar();
  bare.without_rocks = true;
  EXPECT_NEAR(build_dem(bare, {.cell_m = 1.0}, {}).dem.heights.at(3, 4), 0.0F, 1e-6F);
}

TEST_F(Mapping, AWorldWhoseZPointsDownIsTurned) {
  write_scans();
  // The same drive in a world of forward, right, down: y and z change sign, and half a turn about x on the left.
  text("LiDAR/timestamp.txt", "1000000040,0,0,-2,0,1,0,0\n1500000040,1,0,-2,0,1,0,0\n");
  const DemBuildReport report = build_dem(lidar(), {.cell_m = 1.0}, {});
  EXPECT_TRUE(report.world_z_down);
  EXPECT_NEAR(Dem(report.dem.heights).height(2.5, 2.5).value(), 0.0, 1e-6);
  EXPECT_GT(report.dem.heights.at(3, 4), 0.05F) << "the rock is where it was";
}

TEST_F(Mapping, BodyPosesNeedTheSensorsPlace) {
  write_scans();
  text("run.tum", "1.0 0 0 0.5 0 0 0 1\n1.5 1 0 0.5 0 0 0 1\n");
  BuildDemInputs inputs = lidar();
  inputs.poses = folder_ / "run.tum";
  inputs.p_body_sensor = Eigen::Vector3d(0.0, 0.0, 1.7);
  EXPECT_NEAR(Dem(build_dem(inputs, {.cell_m = 1.0}, {}).dem.heights).height(2.5, 2.5).value(), 0.2, 1e-6);
}

TEST_F(Mapping, ScansWithoutAPoseAreCountedAndNoneAtAllIsAnError) {
  write_scans();
  text("LiDAR/timestamp.txt", "1000000040,0,0,2,1,0,0,0\n");
  EXPECT_EQ(build_dem(lidar(), {.cell_m = 1.0}, {}).without_pose, 1U);
  text("LiDAR/timestamp.txt", "9000000040,0,0,2,1,0,0,0\n");
  EXPECT_THAT([&] { build_dem(lidar(), {}, {}); }, ThrowsMessage<Error>(HasSubstr("none of its poses is within")));
}

TEST_F(Mapping, BrokenScansAndMissingPosesAreNamed) {
  write_scans();
  BuildDemInputs inputs = lidar();
  inputs.poses.clear();
  EXPECT_THAT([&] { build_dem(inputs, {}, {}); }, ThrowsMessage<Error>(HasSubstr("--poses FILE")));
  text("LiDAR/1500000000.txt", "1,2,3\n");
  EXPECT_THAT([&] { build_dem(lidar(), {}, {}); }, ThrowsMessage<Error>(HasSubstr("1500000000.txt:1: a line must be")));
  fs::remove_all(folder_ / "LiDAR");
  EXPECT_THAT([&] { build_dem(lidar(), {}, {}); },
              ThrowsMessage<Error>(HasSubstr("the folder with the scans is missing")));
}

TEST_F(Mapping, PointFilesAreAlreadyInTheMap) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n";
  for (int i = 0; i < 8; ++i) {
    const float point[3] = {0.1F * static_cast<float>(i), 0.5F, 7.25F};
    ply.append(reinterpret_cast<const char*>(point), sizeof point);
  }
  text("landmarks.ply", ply);
  text("points.xyz", "0.1 0.5 7.25\n0.2 0.5 7.25\n0.3 0.5 7.25\n");
  for (const char* name : {"landmarks.ply", "points.xyz"}) {
    const BuildDemInputs inputs{.kind = CloudKind::points, .source = folder_ / name};
    const DemBuildReport report = build_dem(inputs, {.cell_m = 1.0}, {});
    EXPECT_EQ(report.dem.filled, 1U) << name;
    EXPECT_FLOAT_EQ(report.dem.heights.at(0, 0), 7.25F) << name;
  }
  text("cut.ply", ply.substr(0, ply.size() - 5));
  EXPECT_THAT([&] { build_dem({.kind = CloudKind::points, .source = folder_ / "cut.ply"}, {}, {}); },
              ThrowsMessage<Error>(HasSubstr("the file is truncated")));
}

TEST_F(Mapping, DepthImagesAreRasteredFromTheLeftCamera) {
  text("calibration.toml",
       "baseline_m = 0.3\n[left]\nwidth = 8\nheight = 6\nfx = 4.0\nfy = 4.0\ncx = 3.5\ncy = 2.5\n[body]\nT_body_left = "
       "[0,-1,0,0, -1,0,0,0, 0,0,-1,3, 0,0,0,1]\n");  // looks straight down from 3 m
  text("image0/color/1000000000.png", "");
  text("image1/color/1000000000.png", "");
  std::string pfm = "Pf\n8 6\n-1.0\n";
  for (int i = 0; i < 48; ++i) {
    const float depth_m = i == 0 ? 65504.0F : 3.5F;
    pfm.append(reinterpret_cast<const char*>(&depth_m), sizeof depth_m);
  }
  text("image0/depth/1000000000.pfm", pfm);
  text("gt.txt", "1000000000,10,20,1,1,0,0,0\n");
  BuildDemInputs inputs{.kind = CloudKind::depth, .source = folder_, .poses = folder_ / "gt.txt"};
  inputs.pixel_step = 1;
  const DemBuildReport report = build_dem(inputs, {.cell_m = 10.0, .min_points = 1}, {});
  EXPECT_EQ(report.dem.points, 47) << "all but the sky";
  EXPECT_NEAR(report.dem.heights.at(0, 0), 1.0 + 3.0 - 3.5, 1e-6);
}

TEST_F(Mapping, TheThreeRastersLieBesideEachOther) {
  write_scans();
  write_built_dem(folder_ / "dem.tif", build_dem(lidar(), {.cell_m = 1.0}, {}).dem);
  EXPECT_EQ(sigma_beside(folder_ / "dem.tif"), folder_ / "dem_sigma.tif");
  const DemRaster counts = read_dem(folder_ / "dem_count.tif");
  EXPECT_FLOAT_EQ(counts.at(3, 4), 8.0F);
}

TEST(StartFrom, TakesTheInterpolatedPoseAtTheFirstFrame) {
  const Trajectory track = {{0, Pose(rotation_from_rpy(0, 0, 0.2), {0, 0, 0})},
                            {1'000'000'000, Pose(rotation_from_rpy(0, 0, 0.4), {2, 0, 1})}};
  const StartPose start = start_from(track, 500'000'000, {});
  EXPECT_TRUE(start.T_map_body.translation().isApprox(Eigen::Vector3d(1, 0, 0.5)));
  EXPECT_NEAR(yaw_of(start.T_map_body.rotation()), 0.3, 1e-9);
  EXPECT_NEAR(start.sigma_rotation_rad, 0.1 * M_PI / 180.0, 1e-9);
}

TEST(StartFrom, PositionsAloneGiveTheHeadingOfTheMotion) {
  Trajectory track;
  for (int i = 0; i < 10; ++i)
    track.push_back({i * 1'000'000'000LL, Pose(Eigen::Quaterniond::Identity(), {0.0, 1.0 * i, 0.0})});
  const StartPose start = start_from(track, 2'000'000'000, {});
  EXPECT_NEAR(yaw_of(start.T_map_body.rotation()), M_PI / 2, 1e-9);
  EXPECT_NEAR(start.sigma_rotation_rad, 5.0 * M_PI / 180.0, 1e-9);
  EXPECT_THAT([&] { start_from(track, 8'000'000'000, {}); }, ThrowsMessage<Error>(HasSubstr("there is no heading")));
  EXPECT_THAT([&] { start_from(track, 20'000'000'000, {}); },
              ThrowsMessage<Error>(HasSubstr("does not reach over the first frame")));
}

}  // namespace
}  // namespace demslam

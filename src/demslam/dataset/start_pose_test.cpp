#include "demslam/dataset/start_pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(StartPose, ReadsBackWhatItWrites) {
  const StartPose start{Pose(rotation_from_rpy(0.1, 0.2, 0.3), {1.0, 2.0, 3.0}), 0.25, 0.02};
  const TestFolder folder;
  const StartPose read = read_start_pose(folder.text("start.toml", start_pose_toml(start)));
  EXPECT_TRUE(read.T_map_body.matrix().isApprox(start.T_map_body.matrix(), 1e-12));
  EXPECT_DOUBLE_EQ(read.sigma_position_m, 0.25);
  EXPECT_NEAR(read.sigma_rotation_rad, 0.02, 1e-15);
}

TEST(StartPose, TakesDegreesInTheFile) {
  const TestFolder folder;
  const StartPose start = read_start_pose(
      folder.text("start.toml", "T_map_body = [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]\nsigma_rotation_deg = 90.0\n"));
  EXPECT_NEAR(start.sigma_rotation_rad, std::numbers::pi / 2.0, 1e-12);
  EXPECT_TRUE(start.T_map_body.translation().isApprox(Eigen::Vector3d(5.0, 6.0, 7.0)));
}

TEST(StartPose, RefusesAFileThatCannotBeMeant) {
  const TestFolder folder;
  const std::string identity = "T_map_body = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  const auto message = [&](const std::string& toml) {
    return [&, toml] { read_start_pose(folder.text("start.toml", toml)); };
  };
  EXPECT_THAT(message(""), ThrowsMessage<Error>(HasSubstr("'T_map_body' is missing")));
  EXPECT_THAT(message(identity + "sigma_position_m = 0\n"), ThrowsMessage<Error>(HasSubstr("start.toml:2: ")));
  EXPECT_THAT(message(identity + "sigma_rotation_deg = -1\n"), ThrowsMessage<Error>(HasSubstr("must be positive")));
}

}  // namespace
}  // namespace demslam

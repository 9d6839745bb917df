#include "demslam/config/slam_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class SlamConfig : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text) {
    const auto path = std::filesystem::path(testing::TempDir()) / "slam_config_test.toml";
    std::ofstream(path) << text;
    return path;
  }
};

TEST_F(SlamConfig, WritesWhatItReads) {
  SlamOptions options;
  options.use_loops = false;
  options.odometry.method = OdometryMethod::pnp;
  options.odometry.motion.pixel_sigma_px = 0.1 + 0.2;
  options.anchoring.patches = true;
  options.loops.appearance = !options.loops.appearance;
  options.graph.systematic.enabled = true;
  const std::string text = to_toml(options);
  EXPECT_EQ(to_toml(read_slam_config(file(text))), text);
  EXPECT_THAT(text, HasSubstr("method = 'pnp'"));
}

TEST_F(SlamConfig, KeepsTheDefaultsOfWhatAFileDoesNotSay) {
  EXPECT_EQ(to_toml(read_slam_config(file(""))), to_toml(SlamOptions{}));
}

TEST_F(SlamConfig, NamesAnUnknownKeyWithItsLine) {
  EXPECT_THAT([&] { read_slam_config(file("[odometry]\nmin_inlires = 3\n")); },
              ThrowsMessage<Error>(HasSubstr(":2: unknown key 'odometry.min_inlires'; did you mean 'min_inliers'?")));
}

TEST_F(SlamConfig, RefusesValuesThatMakeNoSense) {
  for (const std::string text : {"[frontend]\nmax_features = 1", "[odometry]\npixel_sigma_px = 0.0",
                                 "[odometry]\nmin_depth_m = 5.0\nmax_depth_m = 4.0", "[odometry]\nmethod = 'magic'"}) {
    EXPECT_THROW({ auto options = read_slam_config(file(text)); }, Error) << text;
  }
}

}  // namespace
}  // namespace demslam

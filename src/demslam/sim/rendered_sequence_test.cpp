#include "demslam/sim/rendered_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "demslam/base/error.h"
#include "demslam/sim/simulate.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

SceneOptions small_scene() {
  SceneOptions scene;
  scene.terrain.size_m = 120.0;
  scene.camera.width_px = scene.camera.height_px = 96;
  scene.rover.length_m = 2.0;
  scene.output.depth = false;
  return scene;
}

fs::path simulated(const std::string& name, bool images, SceneOptions scene = small_scene()) {
  const fs::path folder = fs::path(testing::TempDir()) / name;
  fs::remove_all(folder);
  scene.output.images = images;
  simulate(scene, folder);
  return folder;
}

void expect_same_pair(const StereoSequence& a, const StereoSequence& b, std::size_t index) {
  const StereoFrame first = a.frame(index), second = b.frame(index);
  EXPECT_EQ(first.t_ns, second.t_ns);
  EXPECT_TRUE(first.left.pixels == second.left.pixels) << index;
  EXPECT_TRUE(first.right.pixels == second.right.pixels) << index;
}

TEST(RenderedSequence, GivesTheImagesThatSimulateWritesInAnyOrder) {
  const fs::path files = simulated("rendered_files", true), stream = simulated("rendered_stream", false);
  EXPECT_FALSE(is_rendered_dataset(files));
  ASSERT_TRUE(is_rendered_dataset(stream));
  EXPECT_FALSE(fs::exists(stream / "image0"));
  const auto written = open_dataset(files), rendered = open_rendered_dataset(stream);
  ASSERT_EQ(written->size(), rendered->size());
  for (const std::size_t index : {3, 0, 4, 3}) expect_same_pair(*written, *rendered, index);
  EXPECT_EQ(written->rig().left.fx, rendered->rig().left.fx);
  EXPECT_TRUE(rendered->dem_file() && rendered->start());
}

TEST(RenderedSequence, GivesTheUpperByteOfDeeperPixelsAndTheSameExposure) {
  SceneOptions scene = small_scene();
  scene.camera.bits = 12;
  scene.camera.exposure_memory_s = 3.0;
  const auto written = open_dataset(simulated("rendered_deep_files", true, scene));
  const auto rendered = open_rendered_dataset(simulated("rendered_deep_stream", false, scene));
  for (const std::size_t index : {4, 1}) expect_same_pair(*written, *rendered, index);
}

TEST(RenderedSequence, MayBeReadBySeveralThreads) {
  const auto sequence = open_rendered_dataset(simulated("rendered_threads", false));
  const auto alone = open_rendered_dataset(fs::path(testing::TempDir()) / "rendered_threads");
  std::vector<StereoFrame> frames(4);
  {
    std::vector<std::jthread> readers;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      readers.emplace_back([&, i] { frames[i] = sequence->frame(frames.size() - 1 - i); });
    }
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_TRUE(frames[i].left.pixels == alone->frame(frames.size() - 1 - i).left.pixels);
  }
}

TEST(RenderedSequence, SaysThatItsCalibrationIsGone) {
  const fs::path folder = simulated("rendered_broken", false);
  fs::remove(folder / "calibration.toml");
  EXPECT_FALSE(is_rendered_dataset(folder));
  EXPECT_THROW(open_rendered_dataset(folder), Error);
}

}  // namespace
}  // namespace demslam

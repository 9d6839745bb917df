#include "demslam/dataset/inspect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::TestFolder;
using testing::HasSubstr;

/// Smooth noise, the same function for both cameras: the right one sees it `disparity` to the left and `row` px lower.
Image textured(int width, int height, double disparity, double row) {
  Random random(3);
  std::vector<double> waves;
  for (int i = 0; i < 60; ++i) waves.push_back(random.uniform(-1.0, 1.0));
  Image image(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double value = 128.0;
      for (int i = 0; i < 60; i += 3) {
        value += 12.0 * std::sin(waves[i] * (u + disparity) + waves[i + 1] * (v - row) + 6.0 * waves[i + 2]);
      }
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return image;
}

TEST(RowOffset, IsMeasuredToATenthOfAPixel) {
  for (const double row : {-4.0, 0.0, 0.5, 3.2}) {
    const RowOffset found = row_offset(row_differences_px(textured(320, 240, 0.0, 0.0), textured(320, 240, 12.0, row)));
    EXPECT_GT(found.patches, 10U);
    EXPECT_NEAR(found.offset_px, row, 0.1);
    EXPECT_LT(found.spread_px, 0.2);
  }
}

TEST(RowOffset, FlatImagesSayNothing) {
  EXPECT_TRUE(row_differences_px(Image(320, 240, 100), Image(320, 240, 100)).empty());
  EXPECT_EQ(row_offset({}).patches, 0U);
}

class Folder : public testing::Test {
 protected:
  Folder() {
    write_image(folder_.text("left/0.png", ""), textured(320, 240, 0.0, 0.0));
    write_image(folder_.text("right/0.png", ""), textured(320, 240, 12.0, 2.0));
    for (const char* name : {"left/1.png", "right/1.png"}) write_image(folder_.text(name, ""), Image(320, 240, 2));
    folder_.text("times.txt", "5.0\n5.25\n");
  }
  std::unique_ptr<StereoSequence> open(double row_offset_px) const {
    folder_.text("calibration.toml",
                 "baseline_m = 0.3\nrow_offset_px = " + std::to_string(row_offset_px) +
                     "\n[left]\nwidth = 320\nheight = 240\nfx = 200\nfy = 200\ncx = 160\ncy = 120\n");
    return open_dataset(folder_.path());
  }
  TestFolder folder_;
};

TEST_F(Folder, InfoNamesSizeRateAndLength) {
  const DatasetInfo info = inspect(*open(0.0));
  EXPECT_EQ(info.format, "folders");
  EXPECT_EQ(info.pairs, 2U);
  EXPECT_EQ(info.width, 320);
  EXPECT_DOUBLE_EQ(info.duration_s, 0.25);
  EXPECT_DOUBLE_EQ(info.median_rate_hz, 4.0);
  EXPECT_NEAR(info.baseline_m, 0.3, 1e-12);
  EXPECT_FALSE(info.has_dem);
}

TEST_F(Folder, CheckFindsTheRowOffsetThatTheCalibrationLacks) {
  const DatasetCheck check = check_dataset(*open(0.0), {.frames = 1}, {});
  EXPECT_NEAR(check.rows.offset_px, 2.0, 0.1);
  EXPECT_THAT(check.warnings, testing::Contains(HasSubstr("to row_offset_px of the calibration")));
  EXPECT_NEAR(check_dataset(*open(2.0), {.frames = 1}, {}).rows.offset_px, 0.0, 0.1);
  EXPECT_THAT(check_dataset(*open(2.0), {.frames = 1}, {}).warnings, testing::IsEmpty());
}

TEST_F(Folder, CheckNamesBlackFramesAndThoseItCannotRead) {
  EXPECT_THAT(check_dataset(*open(0.0), {}, {}).warnings, testing::Contains("frame 1 is nearly black"));
  folder_.text("right/1.png", "no image");
  const DatasetCheck check = check_dataset(*open(0.0), {}, {});
  EXPECT_EQ(check.frames, 2U);
  EXPECT_THAT(check.problems, testing::ElementsAre(HasSubstr("right/1.png")));
}

TEST(CheckDataset, FindsTheRoverSandboxsRowOffset) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data/rover_sandbox";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const fs::path fitted = fs::path(DEMSLAM_SOURCE_DIR) / "configs/rover_sandbox.toml";
  const DatasetCheck check = check_dataset(*open_dataset(data, "", fitted), {.frames = 40}, {});
  EXPECT_GT(check.rows.patches, 100U);
  EXPECT_NEAR(check.rows.offset_px, 0.0, 0.3) << "with the 3.2 px of the fitted calibration";
}

TEST(CheckDataset, KittiIsRectifiedAsItSays) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data/kitti_seq1";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const DatasetCheck check = check_dataset(*open_dataset(data), {.frames = 3}, {});
  EXPECT_NEAR(check.rows.offset_px, 0.0, 0.3);
  EXPECT_LT(check.rows.spread_px, 0.5);
}

}  // namespace
}  // namespace demslam

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

void write_pair(const TestFolder& folder, const std::string& stem, std::uint8_t grey) {
  folder.image("image0/color/" + stem + ".png", grey);
  folder.image("image1/color/" + stem + ".png", grey + 1);
}

TEST(DemslamReader, ReadsTwoFrames) {
  const TestFolder folder;
  folder.text("calibration.toml", test::small_calibration_toml());
  write_pair(folder, "1000000000", 10);
  write_pair(folder, "500000000", 20);
  const auto sequence = open_dataset(folder.path());
  EXPECT_EQ(sequence->format(), "demslam");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->stamp_ns(0), 500'000'000);
  EXPECT_EQ(sequence->frame(1).left.at(0, 0), 10);
  EXPECT_EQ(sequence->frame(1).right.at(0, 0), 11);
  EXPECT_EQ(sequence->dem_file(), std::nullopt);
  EXPECT_FALSE(sequence->start());
}

TEST(DemslamReader, FindsTheDemAndTheStart) {
  const TestFolder folder;
  folder.text("calibration.toml", test::small_calibration_toml());
  folder.text("dem.tif", "a raster");
  folder.text("start.toml", "T_map_body = [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]\n");
  write_pair(folder, "0", 10);
  const auto sequence = open_dataset(folder.path());
  EXPECT_EQ(sequence->dem_file(), folder.path() / "dem.tif");
  ASSERT_TRUE(sequence->start());
  EXPECT_DOUBLE_EQ(sequence->start()->T_map_body.translation().z(), 7.0);
  EXPECT_THAT(sequence->definition_files(),
              testing::ElementsAre(folder.path() / "calibration.toml", folder.path() / "start.toml"));
}

TEST(DemslamReader, AGivenCalibrationReplacesItsOwn) {
  const TestFolder folder;
  folder.text("calibration.toml", test::small_calibration_toml());
  const auto other = folder.text("other.toml", "row_offset_px = 1.0\n" + test::small_calibration_toml());
  write_pair(folder, "0", 10);
  EXPECT_DOUBLE_EQ(open_dataset(folder.path(), "", other)->rig().right.cy, 3.5);
}

TEST(DemslamReader, RefusesNamesThatAreNoStampAndEmptyFolders) {
  const TestFolder folder;
  folder.text("calibration.toml", test::small_calibration_toml());
  std::filesystem::create_directories(folder.path() / "image0/color");
  std::filesystem::create_directories(folder.path() / "image1/color");
  EXPECT_THAT([&] { open_dataset(folder.path()); }, ThrowsMessage<Error>(HasSubstr("the dataset is empty")));
  write_pair(folder, "frame7", 10);
  EXPECT_THAT([&] { open_dataset(folder.path()); },
              ThrowsMessage<Error>(HasSubstr("frame7.png: the name must be the stamp")));
}

}  // namespace
}  // namespace demslam

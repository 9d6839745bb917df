#include "demslam/dataset/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// A two-frame demslam dataset with everything a dataset can have.
std::unique_ptr<StereoSequence> source(const TestFolder& folder) {
  folder.text("in/calibration.toml",
              test::small_calibration_toml() + "[body]\nT_body_left = [0,0,1,0.5, -1,0,0,0.1, 0,-1,0,1.2, 0,0,0,1]\n");
  folder.text("in/start.toml", "T_map_body = [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]\n");
  folder.text("in/dem.tif", "a raster");
  for (const char* stem : {"1625657732290284032", "1625657732390284032"}) {
    folder.image(std::string("in/image0/color/") + stem + ".png", 40);
    folder.image(std::string("in/image1/color/") + stem + ".png", 80);
  }
  return open_dataset(folder.path() / "in");
}

class Conversion : public testing::TestWithParam<const char*> {};

TEST_P(Conversion, ReadsBackWithItsStampsImagesAndCalibration) {
  const TestFolder folder;
  const auto original = source(folder);
  const std::string format = GetParam();
  const auto output = folder.path() / (format == "rosbag" ? "out.bag" : "out");
  const ConvertedDataset converted = convert_dataset(*original, format, output, {});
  EXPECT_EQ(converted.pairs, 2U);

  const auto read = open_dataset(output);
  EXPECT_EQ(read->format(), format == "rosbag" ? "s3li" : format);
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ(read->stamp_ns(1), 1625657732390284032);
  EXPECT_EQ(read->frame(1).left.pixels, original->frame(1).left.pixels);
  EXPECT_EQ(read->frame(1).right.pixels, original->frame(1).right.pixels);
  EXPECT_TRUE(read->rig().T_left_right.matrix().isApprox(original->rig().T_left_right.matrix(), 1e-12));
  EXPECT_DOUBLE_EQ(read->rig().right.cy, original->rig().right.cy);
  const Pose T_body_left = converted.T_body_newbody * read->rig().T_body_left;
  EXPECT_TRUE(T_body_left.matrix().isApprox(original->rig().T_body_left.matrix(), 1e-9)) << T_body_left.matrix();
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, Conversion, testing::Values("demslam", "euroc", "kitti", "rosbag"),
                         [](const auto& test) { return std::string(test.param); });

TEST(ConvertDataset, KeepsDemAndStartInOurOwnFormat) {
  const TestFolder folder;
  convert_dataset(*source(folder), "demslam", folder.path() / "out", {});
  const auto read = open_dataset(folder.path() / "out");
  EXPECT_EQ(read_text(*read->dem_file()), "a raster");
  EXPECT_DOUBLE_EQ(read->start()->T_map_body.translation().z(), 7.0);
}

TEST(ConvertDataset, RefusesUnknownFormatsAndOutputsThatExist) {
  const TestFolder folder;
  const auto original = source(folder);
  EXPECT_THAT([&] { convert_dataset(*original, "tum", folder.path() / "out", {}); },
              ThrowsMessage<Error>(HasSubstr("cannot be written as 'tum'; known are")));
  EXPECT_THAT([&] { convert_dataset(*original, "kitti", folder.path() / "in", {}); },
              ThrowsMessage<Error>(HasSubstr("exists already")));
  EXPECT_THAT([&] { convert_dataset(*original, "kitti", "/proc/out", {}); },
              ThrowsMessage<Error>(HasSubstr("/proc/out: cannot be written")));
}

}  // namespace
}  // namespace demslam

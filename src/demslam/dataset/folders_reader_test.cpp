#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

void write_two_frames(const TestFolder& folder) {
  for (const char* name : {"left/f9.png", "left/f10.png", "right/f9.png", "right/f10.png"}) folder.image(name, 50);
}

TEST(FoldersReader, ReadsTwoFramesAtTheCalibrationsRate) {
  const TestFolder folder;
  write_two_frames(folder);
  folder.text("calibration.toml", "frame_rate_hz = 4.0\n" + test::small_calibration_toml());
  const auto sequence = open_dataset(folder.path());
  EXPECT_EQ(sequence->format(), "folders");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->stamp_ns(1), 250'000'000);
  EXPECT_EQ(sequence->frame(1).right.at(0, 0), 50);
}

TEST(FoldersReader, TimesReplaceTheRate) {
  const TestFolder folder;
  write_two_frames(folder);
  folder.text("times.txt", "100.5\n100.75\n");
  folder.text("calibration.toml", test::small_calibration_toml());
  EXPECT_EQ(open_dataset(folder.path())->stamp_ns(1), 100'750'000'000);
}

TEST(FoldersReader, SaysWhereTheCalibrationShouldBe) {
  const TestFolder folder;
  write_two_frames(folder);
  EXPECT_THAT([&] { open_dataset(folder.path()); },
              ThrowsMessage<Error>(HasSubstr("calibration.toml: the calibration is missing; put one there or pass")));
}

TEST(FoldersReader, OpensTheRoverSandbox) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data/rover_sandbox";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const auto sequence = open_dataset(data, "", fs::path(DEMSLAM_SOURCE_DIR) / "configs/rover_sandbox.toml");
  ASSERT_EQ(sequence->size(), 451U);
  EXPECT_EQ(sequence->stamp_ns(450), 450'000'000'000);
  const StereoFrame frame = sequence->frame(450);
  EXPECT_EQ(frame.left.width, 512);
  EXPECT_EQ(frame.right.height, 288);
}

}  // namespace
}  // namespace demslam

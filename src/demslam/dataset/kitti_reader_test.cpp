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

void write_frames(const TestFolder& folder, const std::string& left, const std::string& right) {
  for (const char* name : {"/000000.png", "/000001.png"}) {
    folder.image(left + name, 10);
    folder.image(right + name, 20);
  }
}

const std::string kCalib =
    "P0: 4 0 3.5 0 0 4 2.5 0 0 0 1 0\nP1: 4 0 3.5 -2 0 4 2.5 0 0 0 1 0\n"
    "P2: 4 0 3.5 0.4 0 4 2.5 0 0 0 1 0\nP3: 4 0 3.5 -1.6 0 4 2.5 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n";

TEST(KittiReader, ReadsTwoFramesAtTenHertz) {
  const TestFolder folder;
  write_frames(folder, "image_0", "image_1");
  folder.text("calib.txt", kCalib);
  const auto sequence = open_dataset(folder.path());
  EXPECT_EQ(sequence->format(), "kitti");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->stamp_ns(1), 100'000'000);
  EXPECT_EQ(sequence->frame(1).right.at(0, 0), 20);
  EXPECT_EQ(sequence->rig().left.width, 8);
  EXPECT_DOUBLE_EQ(sequence->rig().T_left_right.translation().x(), 0.5);
  EXPECT_TRUE(sequence->rig().T_body_left.matrix().isIdentity());
}

TEST(KittiReader, TheColourPairStandsBesideCameraZero) {
  const TestFolder folder;
  write_frames(folder, "image_2", "image_3");
  folder.text("calib.txt", kCalib);
  folder.text("times.txt", "0.0\n1.036224e-01\n");
  const auto sequence = open_dataset(folder.path());
  EXPECT_NEAR(sequence->rig().T_body_left.translation().x(), -0.1, 1e-15);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().x(), 0.5, 1e-15);
  EXPECT_EQ(sequence->stamp_ns(1), 103'622'400);
}

TEST(KittiReader, RefusesABrokenCalib) {
  const TestFolder folder;
  write_frames(folder, "image_0", "image_1");
  const auto open = [&](const std::string& calib) {
    return [&folder, calib] {
      folder.text("calib.txt", calib);
      open_dataset(folder.path());
    };
  };
  EXPECT_THAT(open("P0: 4 0 3.5 0\n"),
              ThrowsMessage<Error>(HasSubstr("calib.txt:1: a projection matrix must have 12")));
  EXPECT_THAT(open("P0: 4 0 3.5 0 0 4 2.5 0 0 0 1 0\n"),
              ThrowsMessage<Error>(HasSubstr("the lines P0 and P1 are missing")));
  EXPECT_THAT(open("4 0 3.5 0 0 4 2.5 0 0 0 1 0\n4 0 3.5 0 0 4 2.5 0 0 0 1 0\n"),
              ThrowsMessage<Error>(HasSubstr("the baseline must be positive")));
  EXPECT_THAT(open("0 0 3.5 0 0 0 2.5 0 0 0 1 0\n0 0 3.5 -2 0 0 2.5 0 0 0 1 0\n"),
              ThrowsMessage<Error>(HasSubstr("focal length must be positive")));
}

TEST(KittiReader, AMissingImageIsNamed) {
  const TestFolder folder;
  write_frames(folder, "image_0", "image_1");
  folder.text("calib.txt", kCalib);
  fs::remove(folder.path() / "image_1/000001.png");
  EXPECT_THAT([&] { open_dataset(folder.path()); }, ThrowsMessage<Error>(HasSubstr("image_0/000001.png: its partner")));
}

TEST(KittiReader, OpensTheRealSequence) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data/kitti_seq1";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const auto sequence = open_dataset(data);
  EXPECT_EQ(sequence->format(), "kitti");
  ASSERT_EQ(sequence->size(), 51U);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().x(), 0.5371506532, 1e-9);
  EXPECT_EQ(sequence->frame(50).left.width, 1226);
}

}  // namespace
}  // namespace demslam

#include "demslam/dataset/image_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(ImageSequence, SortsNumbersByTheirValue) {
  std::vector<std::string> names = {"frame10.png", "frame2.png", "a.png", "frame01.png", "frame1b.png"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names, ElementsAre("a.png", "frame01.png", "frame1b.png", "frame2.png", "frame10.png"));
  EXPECT_FALSE(natural_less("frame1.png", "frame1.png"));
  EXPECT_NE(natural_less("frame1.png", "frame01.png"), natural_less("frame01.png", "frame1.png"));
}

TEST(ImageSequence, NamesAnImageWithoutItsPartner) {
  const TestFolder folder;
  for (const char* name : {"l/0.png", "l/1.png", "r/0.png"}) folder.image(name, 0);
  const auto pair = [&] { pair_images(folder.path() / "l", folder.path() / "r"); };
  EXPECT_THAT(pair, ThrowsMessage<Error>(HasSubstr("l/1.png: its partner in")));
  folder.image("r/1.png", 0);
  folder.image("r/2.png", 0);
  EXPECT_THAT(pair, ThrowsMessage<Error>(HasSubstr("r/2.png: its partner in")));
}

TEST(ImageSequence, PairsByOrderWhereTheCamerasNameTheirImagesDifferently) {
  const TestFolder folder;
  for (const char* name : {"l/left_2.png", "l/left_10.png", "r/right_2.png", "r/right_10.png"}) folder.image(name, 0);
  const auto pairs = pair_images(folder.path() / "l", folder.path() / "r");
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[1].left.filename(), "left_10.png");
  EXPECT_EQ(pairs[1].right.filename(), "right_10.png");
  folder.image("r/right_11.png", 0);
  EXPECT_THAT([&] { pair_images(folder.path() / "l", folder.path() / "r"); },
              ThrowsMessage<Error>(HasSubstr("has 2 images but")));
}

TEST(ImageSequence, AMissingFolderIsNamed) {
  EXPECT_THAT([] { image_files("/nowhere/left"); }, ThrowsMessage<Error>(HasSubstr("/nowhere/left: the image folder")));
}

TEST(ImageSequence, StampsComeFromTimesOrFromTheRate) {
  const TestFolder folder;
  std::vector<StereoFiles> pairs(3);
  stamp_pairs(pairs, folder.path() / "times.txt", 10.0);
  EXPECT_EQ(pairs[2].t_ns, 200'000'000);
  stamp_pairs(pairs, folder.text("times.txt", "0.0\n1.036224e-01\n2.072448e-01\n"), 10.0);
  EXPECT_EQ(pairs[1].t_ns, 103'622'400);
  folder.text("times.txt", "0.0\n0.1\n");
  EXPECT_THAT([&] { stamp_pairs(pairs, folder.path() / "times.txt", 10.0); },
              ThrowsMessage<Error>(HasSubstr("has 2 stamps for 3 pairs")));
  folder.text("times.txt", "0.0\n0.1\nsoon\n");
  EXPECT_THAT([&] { stamp_pairs(pairs, folder.path() / "times.txt", 10.0); },
              ThrowsMessage<Error>(HasSubstr("times.txt:3: 'soon'")));
}

TEST(ImageSequence, AnEmptyDatasetIsRefused) {
  EXPECT_THAT([] { make_sequence({.path = "here"}); }, ThrowsMessage<Error>(HasSubstr("here: the dataset is empty")));
}

TEST(ImageSequence, StampsThatDoNotIncreaseAreRefused) {
  ImageDataset dataset{.path = "here", .pairs = {{5, "a.png", "a.png"}, {5, "b.png", "b.png"}}};
  EXPECT_THAT([&] { make_sequence(dataset); }, ThrowsMessage<Error>(HasSubstr("b.png at 0.000000005 s follows a.png")));
}

class FrameSizes : public testing::Test {
 protected:
  StereoFrame read() const {
    ImageDataset dataset{.path = folder_.path(), .pairs = {{7, folder_.path() / "l.png", folder_.path() / "r.png"}}};
    dataset.rig.left.width = 8;
    dataset.rig.left.height = 6;
    return make_sequence(dataset)->frame(0);
  }
  TestFolder folder_;
};

TEST_F(FrameSizes, APairIsReadAsItIs) {
  folder_.image("l.png", 10);
  folder_.image("r.png", 20);
  const StereoFrame frame = read();
  EXPECT_EQ(frame.t_ns, 7);
  EXPECT_EQ(frame.left.at(3, 2), 10);
  EXPECT_EQ(frame.right.at(3, 2), 20);
}

TEST_F(FrameSizes, LeftAndRightOfDifferentSizeAreBothNamed) {
  folder_.image("l.png", 10);
  folder_.image("r.png", 20, 9, 6);
  EXPECT_THAT([&] { read(); },
              ThrowsMessage<Error>(testing::AllOf(HasSubstr("l.png is 8x6"), HasSubstr("r.png is 9x6"))));
}

TEST_F(FrameSizes, AnImageOfAnotherSizeThanTheCalibrationIsNamed) {
  folder_.image("l.png", 10, 9, 6);
  folder_.image("r.png", 20, 9, 6);
  EXPECT_THAT([&] { read(); }, ThrowsMessage<Error>(HasSubstr("l.png is 9x6 but the calibration is for 8x6")));
}

TEST_F(FrameSizes, AMissingImageIsNamed) {
  folder_.image("l.png", 10);
  EXPECT_THAT([&] { read(); }, ThrowsMessage<Error>(HasSubstr("r.png")));
}

TEST_F(FrameSizes, AHalfWrittenImageIsNamed) {
  folder_.image("r.png", 20);
  const auto whole = folder_.image("l.png", 10, 8, 6);
  std::filesystem::resize_file(whole, std::filesystem::file_size(whole) / 2);
  EXPECT_THAT([&] { read(); }, ThrowsMessage<Error>(HasSubstr("l.png")));
}

}  // namespace
}  // namespace demslam

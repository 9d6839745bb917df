#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/ros_messages.h"
#include "demslam/dataset/rosbag_writer.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

const RectifiedRig kRig{8, 6, 4.0, 3.5, 2.5, 0.2003247};
constexpr TimestampNs kStart = 1625657732290284032;

struct Written {
  std::vector<TimestampNs> left, right;  ///< stamps, in the order of recording
  std::string topic = "image_rect";
  bool with_camera_info = true;
};

/// Grey values count up from 10 (left) and 110 (right).
void write_camera(BagWriter& writer, const std::string& side, const Written& written,
                  const std::vector<TimestampNs>& stamps) {
  const std::string prefix = "/stereo/" + side + "/";
  const RosType &image_type = ros_image_type(), &info_type = ros_camera_info_type();
  const auto image = writer.add_topic(prefix + written.topic, image_type.name, image_type.md5, image_type.definition);
  const auto info = writer.add_topic(prefix + "camera_info", info_type.name, info_type.md5, info_type.definition);
  auto grey = static_cast<std::uint8_t>(side == "left" ? 10 : 110);
  const double baseline_m = side == "left" ? 0.0 : kRig.baseline_m;
  TimestampNs received_ns = kStart;
  for (const TimestampNs t_ns : stamps) {
    received_ns += 1'000'000;
    writer.write(image, received_ns, encode_ros_image(Image(8, 6, grey++), t_ns, side));
    if (written.with_camera_info) writer.write(info, received_ns, encode_ros_camera_info(kRig, baseline_m, t_ns, side));
  }
}

fs::path write_bag(const TestFolder& folder, const Written& written, Compression compression = Compression::none) {
  const fs::path file = folder.path() / "s.bag";
  BagWriter writer(file, compression);
  write_camera(writer, "left", written, written.left);
  write_camera(writer, "right", written, written.right);
  writer.finish();
  return file;
}

class S3liReader : public testing::TestWithParam<Compression> {};

TEST_P(S3liReader, PairsByHeaderStampAndCountsTheRest) {
  const TestFolder folder;
  const auto sequence = open_dataset(
      write_bag(folder, {{kStart, kStart + 33, kStart + 66}, {kStart, kStart + 66, kStart + 99}}, GetParam()));
  EXPECT_EQ(sequence->format(), "s3li");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->unpaired(), 2U);
  EXPECT_EQ(sequence->stamp_ns(1), kStart + 66);
  EXPECT_EQ(sequence->frame(1).left.at(7, 5), 12);
  EXPECT_EQ(sequence->frame(1).right.at(7, 5), 111);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().x(), 0.2003247, 1e-12);
  EXPECT_EQ(sequence->rig().left.fx, 4.0);
}

INSTANTIATE_TEST_SUITE_P(AllCompressions, S3liReader,
                         testing::Values(Compression::none, Compression::bz2, Compression::lz4),
                         [](const auto& test) { return name_of(test.param); });

TEST(S3liReaderOnce, ImagesRecordedOutOfOrderAreSortedByStamp) {
  const TestFolder folder;
  const auto sequence = open_dataset(write_bag(folder, {{kStart + 33, kStart}, {kStart, kStart + 33}}));
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->frame(0).left.at(0, 0), 11);
  EXPECT_EQ(sequence->frame(0).right.at(0, 0), 110);
}

TEST(S3liReaderOnce, WhatCannotBeMeantIsRefused) {
  const TestFolder folder;
  const auto opening = [&](const Written& written) {
    return [&folder, written] { open_dataset(write_bag(folder, written)); };
  };
  EXPECT_THAT(opening({{kStart, kStart}, {kStart}}),
              ThrowsMessage<Error>(HasSubstr("has two images with the stamp 1625657732.290284032")));
  EXPECT_THAT(opening({{kStart}, {kStart + 1}}), ThrowsMessage<Error>(HasSubstr("the dataset is empty")));
  EXPECT_THAT(opening({{kStart}, {kStart}, "image_rect", false}),
              ThrowsMessage<Error>(HasSubstr("camera_info has no message; pass --calibration")));
  EXPECT_THAT(opening({{kStart}, {kStart}, "image_raw"}),
              ThrowsMessage<Error>(HasSubstr("/stereo/left/image_raw is not rectified")));
}

TEST(S3liReaderOnce, ABagWithoutStereoImagesSaysWhatItHas) {
  const fs::path bag = fs::path(DEMSLAM_SHARED_DIR) / "data/rosbag/example.bag";
  if (!fs::exists(bag)) GTEST_SKIP() << bag << " is not here";
  EXPECT_THAT([&] { open_dataset(bag); }, ThrowsMessage<Error>(HasSubstr("/turtle1/pose (turtlesim/Pose)")));
}

}  // namespace
}  // namespace demslam

#include "demslam/dataset/ros_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/bytes.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// A sensor_msgs/Image of one row, byte by byte.
Bytes image_message(const std::string& encoding, std::uint32_t width, const Bytes& data, bool big_endian = false) {
  ByteWriter writer;
  writer.number(std::uint32_t{42}).number(std::uint32_t{1625657732}).number(std::uint32_t{290284032}).text("cam");
  writer.number(std::uint32_t{1}).number(width).text(encoding).number(std::uint8_t{big_endian});
  writer.number(static_cast<std::uint32_t>(data.size())).block(data);
  return writer.bytes();
}

TEST(RosMessages, TheHeadersStampIsExact) {
  EXPECT_EQ(ros_header_stamp(image_message("mono8", 1, {0}), "b"), 1625657732290284032);
}

TEST(RosMessages, EveryEncodingBecomesGrey) {
  const auto grey = [](const Bytes& message) { return decode_ros_image(message, "b").pixels; };
  EXPECT_THAT(grey(image_message("mono8", 3, {1, 2, 255})), ElementsAre(1, 2, 255));
  EXPECT_THAT(grey(image_message("8UC1", 1, {9})), ElementsAre(9));
  EXPECT_THAT(grey(image_message("mono16", 2, {0xff, 0x01, 0x00, 0x80})), ElementsAre(1, 128));
  EXPECT_THAT(grey(image_message("16UC1", 1, {0x01, 0xff}, true)), ElementsAre(1));
  EXPECT_THAT(grey(image_message("rgb8", 1, {200, 100, 50})), ElementsAre(124));
  EXPECT_THAT(grey(image_message("bgr8", 1, {50, 100, 200})), ElementsAre(124));
  EXPECT_THAT(grey(image_message("rgba8", 1, {200, 100, 50, 0})), ElementsAre(124));
  EXPECT_THAT(grey(image_message("bgra8", 1, {50, 100, 200, 9})), ElementsAre(124));
}

TEST(RosMessages, PaddingAtTheEndOfARowIsSkipped) {
  ByteWriter writer;
  writer.number(std::uint32_t{0}).number(std::uint32_t{0}).number(std::uint32_t{0}).text("");
  writer.number(std::uint32_t{2}).number(std::uint32_t{2}).text("mono8").number(std::uint8_t{0});
  writer.number(std::uint32_t{3}).block(Bytes{1, 2, 99, 3, 4, 99});
  EXPECT_THAT(decode_ros_image(writer.bytes(), "b").pixels, ElementsAre(1, 2, 3, 4));
}

TEST(RosMessages, WhatCannotBeReadIsRefused) {
  EXPECT_THAT([] { decode_ros_image(image_message("bayer_rggb8", 1, {0}), "x.bag"); },
              ThrowsMessage<Error>(HasSubstr("x.bag: unknown image encoding 'bayer_rggb8'; known are")));
  EXPECT_THAT([] { decode_ros_image(image_message("mono8", 3, {0, 1}), "x.bag"); },
              ThrowsMessage<Error>(HasSubstr("fewer bytes than its size needs")));
  const Bytes whole = image_message("mono8", 3, {0, 1, 2});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THROW(decode_ros_image(ByteSpan(whole).first(size), "x.bag"), Error) << size;
  }
}

TEST(RosMessages, AnImageReadsBackAsItWasWritten) {
  Image image(3, 2);
  for (std::size_t i = 0; i < 6; ++i) image.pixels[i] = static_cast<std::uint8_t>(40 * i);
  const Bytes message = encode_ros_image(image, 1625657732290284032, "left");
  EXPECT_EQ(ros_header_stamp(message, "b"), 1625657732290284032);
  EXPECT_EQ(decode_ros_image(message, "b").pixels, image.pixels);
}

TEST(RosMessages, ACameraInfoReadsBackAsItWasWritten) {
  const RectifiedRig rig{688, 512, 579.488, 342.133, 255.806, 0.2003247};
  const RosCameraInfo info = decode_ros_camera_info(encode_ros_camera_info(rig, 0.2003247, 5, "right"), "b");
  EXPECT_EQ(info.rectified().width, 688);
  EXPECT_EQ(info.rectified().height, 512);
  EXPECT_DOUBLE_EQ(info.rectified().fx, 579.488);
  EXPECT_DOUBLE_EQ(info.rectified().cy, 255.806);
  EXPECT_DOUBLE_EQ(-info.P[3] / info.P[0], 0.2003247);
  EXPECT_DOUBLE_EQ(info.K[4], 579.488);
}

}  // namespace
}  // namespace demslam

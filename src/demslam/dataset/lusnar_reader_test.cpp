#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// 8x6 RGBA, every pixel (200, 100, 50, 255).
constexpr std::array<unsigned char, 75> kRgbaPng = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00, 0x00,
    0x08, 0x00, 0x00, 0x00, 0x06, 0x08, 0x06, 0x00, 0x00, 0x00, 0xfe, 0x05, 0xdf, 0xfb, 0x00, 0x00, 0x00, 0x12, 0x49,
    0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x38, 0x91, 0x62, 0xf4, 0x1f, 0x1f, 0x66, 0x18, 0x0a, 0x0a, 0x00, 0xd6, 0xd3,
    0x71, 0x71, 0x60, 0xdb, 0xf6, 0x25, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

void write_frames(const TestFolder& folder, const std::string& left, const std::string& right) {
  const std::string png(kRgbaPng.begin(), kRgbaPng.end());
  for (const std::string stem : {"/1692602304.png", "/1692702304.png"}) {
    folder.text(left + stem, png);
    folder.text(right + stem, png);
  }
}

class LusnarLayouts : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(LusnarLayouts, AreBothRead) {
  const TestFolder folder;
  write_frames(folder, GetParam().first, GetParam().second);
  folder.text("gt.txt", "# never read here\n");
  const auto calibration = folder.text("small.toml", test::small_calibration_toml());
  const auto sequence = open_dataset(folder.path(), "", calibration);
  EXPECT_EQ(sequence->format(), "lusnar");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->stamp_ns(1), 1692702304);
  EXPECT_EQ(sequence->frame(1).left.at(2, 3), 124) << "Rec. 601 luma of (200, 100, 50), whatever alpha says";
}

INSTANTIATE_TEST_SUITE_P(LusnarReader, LusnarLayouts,
                         testing::Values(std::pair("image0/color", "image1/color"),
                                         std::pair("image1/RGB", "image2/RGB"), std::pair("image0/RGB", "image1/RGB"),
                                         std::pair("image1/color", "image2/color")));

TEST(LusnarReader, TheBuiltInCalibrationLooksForwardAndDown) {
  const TestFolder folder;
  write_frames(folder, "image0/color", "image1/color");
  const auto sequence = open_dataset(folder.path());
  const StereoRig& rig = sequence->rig();
  EXPECT_DOUBLE_EQ(rig.left.fx, 610.17784);
  EXPECT_DOUBLE_EQ(rig.T_left_right.translation().x(), 0.31);
  const Eigen::Vector3d axis = rig.T_body_left.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(axis.x(), std::cos(20.0 * M_PI / 180.0), 1e-12);
  EXPECT_NEAR(axis.z(), -std::sin(20.0 * M_PI / 180.0), 1e-12);
  EXPECT_TRUE(rig.T_body_left.translation().isApprox(Eigen::Vector3d(1.0, 0.155, 1.5)));
  EXPECT_THAT([&] { sequence->frame(0); },
              ThrowsMessage<Error>(HasSubstr("is 8x6 but the calibration is for 1024x1024")));
}

TEST(LusnarReader, ThePairIsSymmetricAboutTheRoversMiddle) {
  const TestFolder folder;
  write_frames(folder, "image0/color", "image1/color");
  const StereoRig rig = open_dataset(folder.path())->rig();
  const Pose T_body_right = rig.T_body_left * rig.T_left_right;
  EXPECT_NEAR(T_body_right.translation().y(), -0.155, 1e-12);
}

}  // namespace
}  // namespace demslam

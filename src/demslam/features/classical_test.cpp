#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "demslam/base/error.h"
#include "demslam/features/frontend.h"
#include "demslam/features/test_images.h"

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

Features extract(const Image& image, int max_features = 500) {
  return make_frontend({.max_features = max_features}).extractor->extract(image);
}

std::vector<Match> match(const Features& a, const Features& b) { return make_frontend({}).matcher->match(a, b); }

/// A round pebble of 2 px, bright on grey, centred on (u, v).
Image pebble_at(double u, double v) {
  Image image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double r2 = (x - u) * (x - u) + (y - v) * (y - v);
      image.at(x, y) = static_cast<std::uint8_t>(std::lround(50.0 + 150.0 * std::exp(-r2 / (2.0 * 1.4 * 1.4))));
    }
  }
  return image;
}

TEST(ClassicalExtractor, FindsAPebbleAtItsSubPixelPlace) {
  for (const auto& [u, v] : {std::pair{31.0, 30.0}, {31.25, 30.5}, {30.8, 33.4}}) {
    const Features features = extract(pebble_at(u, v));
    ASSERT_GE(features.size(), 1U);
    const auto strongest = std::max_element(features.scores.begin(), features.scores.end()) - features.scores.begin();
    EXPECT_NEAR(features.keypoints[strongest].x(), u, 0.1);
    EXPECT_NEAR(features.keypoints[strongest].y(), v, 0.1);
  }
}

TEST(ClassicalExtractor, GivesTheSameBytesTwice) {
  const Image image = test::Texture(3).draw(200, 160);
  const Features a = extract(image), b = extract(image);
  ASSERT_GT(a.size(), 50U);
  EXPECT_EQ(a.keypoints, b.keypoints);
  EXPECT_EQ(a.scores, b.scores);
  EXPECT_EQ(a.descriptors, b.descriptors);
}

TEST(ClassicalExtractor, GivesUnitRowsAndTheImageSize) {
  const Features features = extract(test::Texture(3).draw(200, 160));
  EXPECT_EQ(features.image_width, 200);
  EXPECT_EQ(features.image_height, 160);
  EXPECT_EQ(features.descriptors.rows(), static_cast<Eigen::Index>(features.size()));
  EXPECT_EQ(features.scores.size(), features.size());
  EXPECT_LT((features.descriptors.rowwise().norm().array() - 1.0F).abs().maxCoeff(), 1e-5F);
}

TEST(ClassicalExtractor, FindsNothingWhereThereIsNothing) {
  for (const Image& image : {Image(), Image(320, 240, 0), Image(320, 240, 255), Image(5, 3, 7), Image(320, 8, 9)}) {
    EXPECT_EQ(extract(image).size(), 0U);
    EXPECT_EQ(extract(image).descriptors.rows(), 0);
  }
}

TEST(ClassicalExtractor, KeepsTheLimitAndSpreadsOverTheImage) {
  const Features features = extract(test::Texture(5).draw(320, 320), 100);
  EXPECT_EQ(features.size(), 100U);
  std::set<std::pair<int, int>> cells;
  for (const Eigen::Vector2f& k : features.keypoints)
    cells.emplace(static_cast<int>(k.x()) / 32, static_cast<int>(k.y()) / 32);
  EXPECT_GE(cells.size(), 90U);  // of 100
}

TEST(ClassicalExtractor, SeesTextureOfAFewGreyLevelsInTheDark) {
  Image dark = test::Texture(3).draw(200, 160);
  for (std::uint8_t& pixel : dark.pixels) pixel /= 16;
  EXPECT_GT(extract(dark).size(), 50U);
}

TEST(ClassicalFrontend, RecoversASubPixelShift) {
  const test::Texture texture(7);
  const Features a = extract(texture.draw(320, 240)), b = extract(texture.draw(320, 240, -7.3, 2.6));
  const std::vector<Match> matches = match(a, b);
  ASSERT_GT(matches.size(), 100U);
  const test::Shift shift = test::shift_of(a, b, matches);
  EXPECT_NEAR(shift.median.x(), -7.3, 0.1);
  EXPECT_NEAR(shift.median.y(), 2.6, 0.1);
  EXPECT_GT(shift.share_within_1px, 0.9);
}

TEST(ClassicalFrontend, IsMostlyRightOnARealStereoPair) {
  const std::filesystem::path data = std::filesystem::path(DEMSLAM_SHARED_DIR) / "data/rover_sandbox";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no " << data;
  const Features left = extract(read_image(data / "left/frame0100.jpg"), 1000);
  const Features right = extract(read_image(data / "right/frame0100.jpg"), 1000);
  const std::vector<Match> matches = match(left, right);
  ASSERT_GT(matches.size(), 400U);
  const auto on_row = std::count_if(matches.begin(), matches.end(), [&](const Match& m) {
    return std::abs(right.keypoints[m.train].y() - left.keypoints[m.query].y() - 3.2F) < 1.5F;
  });
  EXPECT_GT(on_row, static_cast<int>(matches.size()) * 85 / 100);
}

TEST(MakeFrontend, RefusesUnknownNames) {
  EXPECT_THAT(
      [] { make_frontend({.extractor = "superglue"}); },
      ThrowsMessage<Error>(HasSubstr("unknown extractor 'superglue'; known: classical, lunar, onnx, orb, sift")));
  EXPECT_THAT([] { make_frontend({.matcher = "flann"}); }, ThrowsMessage<Error>(HasSubstr("unknown matcher 'flann'")));
}

}  // namespace
}  // namespace demslam

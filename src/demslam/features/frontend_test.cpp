#include "demslam/features/frontend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "demslam/base/error.h"
#include "demslam/features/model_info.h"
#include "demslam/features/test_images.h"

namespace demslam {
namespace {

Frontend with(const std::string& extractor) { return make_frontend({.extractor = extractor, .max_features = 400}); }

class EveryBuiltInExtractor : public testing::TestWithParam<const char*> {};

TEST_P(EveryBuiltInExtractor, RecoversAShiftOfAnImageWithNearestNeighbours) {
  const Frontend frontend = with(GetParam());
  const test::Texture texture(7);
  const Features a = frontend.extractor->extract(texture.draw(330, 250)),
                 b = frontend.extractor->extract(texture.draw(330, 250, -13.0, 5.0));
  ASSERT_GT(a.size(), 50U);
  EXPECT_LT((a.descriptors.rowwise().norm().array() - 1.0F).abs().maxCoeff(), 1e-4F);
  const std::vector<Match> matches = frontend.matcher->match(a, b);
  ASSERT_GT(matches.size(), 30U);
  const test::Shift shift = test::shift_of(a, b, matches);
  EXPECT_NEAR(shift.median.x(), -13.0, 0.2);
  EXPECT_NEAR(shift.median.y(), 5.0, 0.2);
}

TEST_P(EveryBuiltInExtractor, FindsNothingInAnEmptyImageAndBearsABlackOne) {
  const Frontend frontend = with(GetParam());
  EXPECT_EQ(frontend.extractor->extract(Image()).size(), 0U);
  const Features black = frontend.extractor->extract(Image(96, 64));
  EXPECT_EQ(black.keypoints.size(), static_cast<std::size_t>(black.descriptors.rows()));
  EXPECT_TRUE(black.descriptors.allFinite());
}

INSTANTIATE_TEST_SUITE_P(Names, EveryBuiltInExtractor, testing::Values("classical", "lunar", "orb", "sift"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Lunar, IsAnExtractorOfContractXfeatThatCompaniesMayUse) {
  const ModelInfo info = inspect_built_in_model("lunar");
  EXPECT_EQ(info.contract, Contract::xfeat);
  EXPECT_EQ(info.descriptor_width, 64);
  EXPECT_THAT(info.card.licence, testing::HasSubstr("Apache-2.0"));
}

TEST(LunarMatcher, IsAMatcherOfContractLightglueThatCompaniesMayUse) {
  const ModelInfo info = inspect_built_in_model("lunar-matcher");
  EXPECT_EQ(info.contract, Contract::lightglue);
  EXPECT_EQ(info.descriptor_width, 64);
  EXPECT_THAT(info.card.licence, testing::HasSubstr("Apache-2.0"));
}

TEST(LunarMatcher, FindsAShiftAndItsMatchesAreOneToOne) {
  const Frontend frontend = make_frontend({.extractor = "lunar", .matcher = "lunar", .max_features = 400});
  const test::Texture texture(7);
  const Features a = frontend.extractor->extract(texture.draw(330, 250)),
                 b = frontend.extractor->extract(texture.draw(330, 250, -13.0, 5.0));
  const std::vector<Match> matches = frontend.matcher->match(a, b);
  ASSERT_GT(matches.size(), 30U);
  std::set<int> queries, trains;
  for (const Match& match : matches) {
    EXPECT_TRUE(queries.insert(match.query).second);
    EXPECT_TRUE(trains.insert(match.train).second);
  }
  const test::Shift shift = test::shift_of(a, b, matches);
  EXPECT_NEAR(shift.median.x(), -13.0, 0.2);
  EXPECT_NEAR(shift.median.y(), 5.0, 0.2);
}

TEST(LunarMatcher, BearsViewsOfOnePointOrNone) {
  const Frontend frontend = make_frontend({.extractor = "lunar", .matcher = "lunar", .max_features = 400});
  Features one = frontend.extractor->extract(test::Texture(7).draw(330, 250));
  const Features all = one;
  one.keypoints.resize(1);
  one.scores.resize(1);
  one.descriptors.conservativeResize(1, one.descriptors.cols());
  EXPECT_LE(frontend.matcher->match(one, all).size(), 1U);
  EXPECT_LE(frontend.matcher->match(all, one).size(), 1U);
  EXPECT_THAT(frontend.matcher->match(Features(), all), testing::IsEmpty());
}

TEST(LunarMatcher, RefusesDescriptorsOfAnotherWidth) {
  EXPECT_THAT([] { make_frontend({.extractor = "classical", .matcher = "lunar"}); },
              testing::ThrowsMessage<Error>(
                  testing::HasSubstr("lunar: matches descriptors of width 64, but the extractor gives width 128")));
}

TEST(Lunar, GivesTheSameBytesTwice) {
  const Image image = test::Texture(5).draw(160, 128);
  const Features once = with("lunar").extractor->extract(image), again = with("lunar").extractor->extract(image);
  EXPECT_EQ(once.keypoints, again.keypoints);
  EXPECT_EQ(once.descriptors, again.descriptors);
}

TEST(Lunar, DoesNotMindAnotherExposure) {
  const Image image = test::Texture(5).draw(320, 256);
  Image dark = image;
  for (std::uint8_t& pixel : dark.pixels) pixel = static_cast<std::uint8_t>(pixel / 2);
  const Frontend frontend = with("lunar");
  const Features a = frontend.extractor->extract(image), b = frontend.extractor->extract(dark);
  const test::Shift shift = test::shift_of(a, b, frontend.matcher->match(a, b));
  EXPECT_GT(shift.share_within_1px, 0.8);
}

}  // namespace
}  // namespace demslam

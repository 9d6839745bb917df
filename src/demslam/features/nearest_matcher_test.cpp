#include "demslam/features/nearest_matcher.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <set>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/features/similarity.h"

namespace demslam {
namespace {

Features random_features(int count, int width, std::uint64_t seed) {
  Random random(seed);
  Features features;
  features.keypoints.assign(count, Eigen::Vector2f::Zero());
  features.scores.assign(count, 1.0F);
  features.descriptors.resize(count, width);
  for (int i = 0; i < count * width; ++i) features.descriptors.data()[i] = static_cast<float>(random.normal());
  features.descriptors.rowwise().normalize();
  return features;
}

TEST(BestProducts, AgreesWithAPlainMatrixProductWhateverTheSizes) {
  for (const auto& [rows, columns, width] : {std::array{1, 1, 1}, {5, 3, 7}, {33, 50, 64}, {50, 33, 128}}) {
    const Features a = random_features(rows, width, 1), b = random_features(columns, width, 2);
    const Eigen::MatrixXf products = a.descriptors * b.descriptors.transpose();
    const MutualBest best = best_products({a.descriptors.data(), a.size(), static_cast<std::size_t>(width)},
                                          {b.descriptors.data(), b.size(), static_cast<std::size_t>(width)});
    for (int i = 0; i < rows; ++i) {
      int index = 0;
      EXPECT_NEAR(best.of_query[i].best, products.row(i).maxCoeff(&index), 1e-5F);
      EXPECT_EQ(best.of_query[i].index, index);
    }
    for (int i = 0; i < columns; ++i) {
      int index = 0;
      products.col(i).maxCoeff(&index);
      EXPECT_EQ(best.of_train[i], index);
    }
  }
}

TEST(NearestMatcher, FindsAPermutation) {
  const Features a = random_features(100, 64, 1);
  Features b = a;
  b.descriptors = a.descriptors.colwise().reverse();
  const std::vector<Match> matches = NearestMatcher(0.9).match(a, b);
  ASSERT_EQ(matches.size(), 100U);
  for (const Match& m : matches) EXPECT_EQ(m.train, 99 - m.query);
}

TEST(NearestMatcher, IsOneToOneWithScoresInTheUnitInterval) {
  const std::vector<Match> matches = NearestMatcher(1.0).match(random_features(90, 32, 1), random_features(70, 32, 2));
  ASSERT_GT(matches.size(), 10U);
  std::set<int> queries, trains;
  for (const Match& m : matches) {
    EXPECT_TRUE(queries.insert(m.query).second);
    EXPECT_TRUE(trains.insert(m.train).second);
    EXPECT_GT(m.score, 0.0F);
    EXPECT_LE(m.score, 1.0F);
  }
}

TEST(NearestMatcher, DropsAnAmbiguousTwin) {
  const Features a = random_features(1, 64, 1);
  Features b = random_features(2, 64, 2);
  b.descriptors.row(0) = b.descriptors.row(1) = a.descriptors.row(0);
  EXPECT_TRUE(NearestMatcher(0.9).match(a, b).empty());
}

TEST(NearestMatcher, MatchesNothingWithNothing) {
  const Features none, some = random_features(3, 64, 1);
  EXPECT_TRUE(NearestMatcher(0.9).match(none, some).empty());
  EXPECT_TRUE(NearestMatcher(0.9).match(some, none).empty());
}

TEST(NearestMatcher, MatchesNoDescriptorThatIsNoNumber) {
  Features broken = random_features(1, 64, 1);
  broken.descriptors.setConstant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(NearestMatcher(0.9).match(broken, random_features(1, 64, 2)).empty());
}

TEST(NearestMatcher, RefusesDescriptorsOfDifferentWidth) {
  EXPECT_THROW(NearestMatcher(0.9).match(random_features(3, 64, 1), random_features(3, 128, 1)), Error);
}

}  // namespace
}  // namespace demslam

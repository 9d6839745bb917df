#include "demslam/features/xfeat.h"

#include <gtest/gtest.h>

namespace demslam {
namespace {

constexpr int kRows = 4, kColumns = 6, kWidth = 3, kCells = kRows * kColumns;

/// Maps of a 48x32 image without any keypoint: reliability one, descriptors (column, row, 1).
struct Maps {
  std::vector<float> descriptors = std::vector<float>(kWidth * kCells), logits = std::vector<float>(65 * kCells, 0.0F);
  std::vector<float> reliability = std::vector<float>(kCells, 1.0F);

  Maps() {
    for (int cell = 0; cell < kCells; ++cell) {
      logits[64 * kCells + cell] = 20.0F;
      descriptors[cell] = static_cast<float>(cell % kColumns);
      descriptors[kCells + cell] = static_cast<float>(cell / kColumns);
      descriptors[2 * kCells + cell] = 1.0F;
    }
  }
  void add(int u, int v, float logit) { logits[(v % 8 * 8 + u % 8) * kCells + v / 8 * kColumns + u / 8] = logit; }
  Features decode(int width = 48, int height = 32, int max_features = 10,
                  float min_probability = kXFeatMinProbability) const {
    return decode_xfeat({descriptors, kWidth, kRows, kColumns, logits, reliability}, width, height, max_features,
                        min_probability);
  }
};

TEST(DecodeXFeat, PutsAKeypointAtThePixelOfItsLogit) {
  for (const auto& [u, v] : {std::pair{21, 10}, {0, 0}, {47, 31}, {8, 16}, {7, 15}}) {
    Maps maps;
    maps.add(u, v, 22.0F);
    const Features features = maps.decode();
    ASSERT_EQ(features.size(), 1U);
    EXPECT_NEAR(features.keypoints[0].x(), u, 0.5);
    EXPECT_NEAR(features.keypoints[0].y(), v, 0.5);
  }
}

TEST(DecodeXFeat, TakesKeypointsAboveTheProbabilityAskedFor) {
  Maps maps;
  maps.add(21, 10, 16.1F);  // 0.02
  EXPECT_EQ(maps.decode().size(), 0U);
  EXPECT_EQ(maps.decode(48, 32, 10, 0.01F).size(), 1U);
  EXPECT_EQ(maps.decode(48, 32, 10, 0.03F).size(), 0U);
}

TEST(DecodeXFeat, MovesAKeypointTowardsItsStrongerNeighbour) {
  Maps maps;
  maps.add(20, 10, 22.0F);
  maps.add(21, 10, 21.5F);
  const Features features = maps.decode();
  ASSERT_EQ(features.size(), 1U);
  EXPECT_GT(features.keypoints[0].x(), 20.1F);
  EXPECT_LE(features.keypoints[0].x(), 20.5F);
  EXPECT_FLOAT_EQ(features.keypoints[0].y(), 10.0F);
}

TEST(DecodeXFeat, SuppressesWeakerNeighboursAcrossCellsAndKeepsTheBestFirst) {
  Maps maps;
  maps.add(7, 7, 22.0F);
  maps.add(9, 9, 23.0F);    // two pixels away, in another cell: wins
  maps.add(30, 20, 24.0F);  // far away
  const Features features = maps.decode();
  ASSERT_EQ(features.size(), 2U);
  EXPECT_NEAR(features.keypoints[0].x(), 30.0F, 0.5F);
  EXPECT_NEAR(features.keypoints[1].x(), 9.0F, 0.5F);
  EXPECT_GT(features.scores[0], features.scores[1]);
  EXPECT_EQ(maps.decode(48, 32, 1).size(), 1U);
}

TEST(DecodeXFeat, ScoresProbabilityTimesReliability) {
  Maps maps;
  maps.add(20, 10, 20.0F);  // as likely as "none"
  std::fill(maps.reliability.begin(), maps.reliability.end(), 0.5F);
  EXPECT_NEAR(maps.decode().scores.at(0), 0.25F, 1e-4F);
}

TEST(DecodeXFeat, ReadsTheDescriptorOfItsPlace) {
  Maps maps;
  maps.add(28, 12, 22.0F);  // just right of and below the centre of cell (3, 1)
  const Features features = maps.decode();
  ASSERT_EQ(features.size(), 1U);
  const Eigen::RowVector3f expected = Eigen::RowVector3f(3.0F, 1.0F, 1.0F).normalized();
  EXPECT_GT(features.descriptors.row(0).dot(expected), 0.998F);
  EXPECT_NEAR(features.descriptors.row(0).norm(), 1.0F, 1e-6F);
}

TEST(DecodeXFeat, IgnoresThePadding) {
  Maps maps;
  maps.add(45, 10, 22.0F);
  maps.add(10, 30, 22.0F);
  EXPECT_EQ(maps.decode(45, 30).size(), 0U);
}

}  // namespace
}  // namespace demslam

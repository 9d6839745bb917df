#include "demslam/features/vocabulary.h"

#include <gtest/gtest.h>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr Eigen::Index kWidth = 32, kPoints = 120;

DescriptorRows random_rows(std::uint64_t seed) {
  Random random(seed);
  DescriptorRows rows(kPoints, kWidth);
  for (float& value : rows.reshaped()) value = static_cast<float>(random.normal());
  rows.rowwise().normalize();
  return rows;
}

/// The same place seen again: most points, shuffled, each a little different, and some new ones.
DescriptorRows seen_again(const DescriptorRows& rows, std::uint64_t seed) {
  Random random(seed);
  DescriptorRows again = random_rows(seed + 1000);
  for (Eigen::Index row = 0; row < kPoints * 6 / 10; ++row) {
    again.row(kPoints - 1 - row) = rows.row(row);
    for (float& value : again.row(kPoints - 1 - row)) value += 0.05F * static_cast<float>(random.normal());
  }
  again.rowwise().normalize();
  return again;
}

TEST(Vocabulary, TellsAPlaceSeenAgainFromTwoHundredOthers) {
  std::vector<DescriptorRows> places;
  for (std::uint64_t place = 0; place < 200; ++place) places.push_back(random_rows(place));
  const Vocabulary vocabulary = Vocabulary::train({&places[0], &places[1], &places[2], &places[3]}, 8, 1);
  std::vector<Eigen::VectorXf> described;
  for (const DescriptorRows& place : places) described.push_back(vocabulary.describe(place));
  int right = 0;
  for (std::size_t place = 0; place < 200; place += 10) {
    const Eigen::VectorXf again = vocabulary.describe(seen_again(places[place], place));
    std::size_t best = 0;
    for (std::size_t other = 0; other < 200; ++other) {
      if (again.dot(described[other]) > again.dot(described[best])) best = other;
    }
    right += best == place;
  }
  EXPECT_GE(right, 19);
}

TEST(Vocabulary, IsTheSameForTheSameInput) {
  const DescriptorRows rows = random_rows(5);
  const Vocabulary a = Vocabulary::train({&rows}, 8, 1), b = Vocabulary::train({&rows}, 8, 1);
  EXPECT_EQ(a.describe(rows), b.describe(rows));
  EXPECT_NEAR(a.describe(rows).norm(), 1.0F, 1e-5F);
}

TEST(Vocabulary, AnEmptyImageLooksLikeNothing) {
  const DescriptorRows rows = random_rows(6);
  EXPECT_EQ(Vocabulary::train({&rows}, 4, 1).describe(DescriptorRows(0, kWidth)).norm(), 0.0F);
}

}  // namespace
}  // namespace demslam

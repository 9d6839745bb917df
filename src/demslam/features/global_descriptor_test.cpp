#include "demslam/features/global_descriptor.h"

#include <gtest/gtest.h>

#include <future>
#include <numeric>
#include <vector>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr Eigen::Index kWidth = 64, kPoints = 600;

DescriptorRows random_rows(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  DescriptorRows rows = DescriptorRows::NullaryExpr(count, kWidth, [&] { return static_cast<float>(random.normal()); });
  rows.rowwise().normalize();
  return rows;
}

/// Another view of `place`: 60 % of its points, each a little different, and points of elsewhere.
DescriptorRows seen_again(const DescriptorRows& place, std::uint64_t seed) {
  const Eigen::Index kept = place.rows() * 6 / 10;
  DescriptorRows view = random_rows(place.rows(), seed);
  view.topRows(kept) = place.bottomRows(kept) + 0.3F * view.topRows(kept);
  view.rowwise().normalize();
  return view;
}

class Describer : public testing::Test {
 protected:
  GlobalDescriber describer_{random_rows(8000, 1)};
};

TEST_F(Describer, TheOrderOfTheRowsDoesNotMatter) {
  const DescriptorRows rows = random_rows(kPoints, 2);
  std::vector<Eigen::Index> order(kPoints);
  std::iota(order.begin(), order.end(), 0);
  Random random(3);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.index(i)]);
  DescriptorRows mixed(kPoints, kWidth);
  for (Eigen::Index i = 0; i < kPoints; ++i) mixed.row(i) = rows.row(order[static_cast<std::size_t>(i)]);
  EXPECT_EQ(describer_.describe(mixed), describer_.describe(rows));
}

TEST_F(Describer, ThreadsDoNotMatter) {
  const DescriptorRows rows = random_rows(kPoints, 2);
  const GlobalDescriptor alone = describer_.describe(rows);
  std::vector<std::future<GlobalDescriptor>> others;
  for (int i = 0; i < 4; ++i) {
    others.push_back(
        std::async(std::launch::async, [&] { return GlobalDescriber(random_rows(8000, 1)).describe(rows); }));
  }
  for (auto& other : others) EXPECT_EQ(other.get(), alone);
}

TEST_F(Describer, ASecondViewIsNearerThanAnyOtherPlace) {
  std::vector<DescriptorRows> places;
  for (std::uint64_t p = 0; p < 30; ++p) places.push_back(random_rows(kPoints, 10 + p));
  for (std::size_t p = 0; p < places.size(); ++p) {
    const GlobalDescriptor view = describer_.describe(seen_again(places[p], 100 + p));
    const double same = similarity(view, describer_.describe(places[p]));
    for (std::size_t q = 0; q < places.size(); ++q) {
      if (q == p) continue;
      EXPECT_LT(similarity(view, describer_.describe(places[q])), same) << p << " " << q;
    }
  }
}

TEST_F(Describer, AViewIsLikeItselfAndNothingIsLikeNothing) {
  const GlobalDescriptor view = describer_.describe(random_rows(kPoints, 2));
  const GlobalDescriptor nothing = describer_.describe(DescriptorRows(0, kWidth));
  EXPECT_DOUBLE_EQ(similarity(view, view), 1.0);
  EXPECT_EQ(similarity(view, nothing), 0.0);
  EXPECT_EQ(similarity(nothing, nothing), 0.0);
}

TEST(GlobalDescriber, LearnsFromFewerExamplesThanWords) {
  const DescriptorRows examples = random_rows(GlobalDescriber::kWords / 4, 5);
  const GlobalDescriber describer(examples);
  const GlobalDescriptor a = describer.describe(random_rows(kPoints, 6)),
                         b = describer.describe(random_rows(kPoints, 7));
  EXPECT_GT(similarity(a, a), similarity(a, b));
}

}  // namespace
}  // namespace demslam

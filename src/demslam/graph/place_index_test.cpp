#include "demslam/graph/place_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/random.h"

namespace demslam {
namespace {

DescriptorRows place_rows(std::uint64_t place) {
  Random random(place);
  DescriptorRows rows(100, 32);
  for (float& value : rows.reshaped()) value = static_cast<float>(random.normal());
  rows.rowwise().normalize();
  return rows;
}

TEST(PlaceIndex, FindsThePlaceAgainAmongHundredsAndNoneInANewOne) {
  PlaceIndex index({.min_similarity = 0.5});
  for (std::size_t k = 0; k < 300; ++k) index.add(k, 3.0 * static_cast<double>(k), place_rows(k));
  EXPECT_EQ(index.places(), 300U);
  index.add(300, 900.0, place_rows(123));
  EXPECT_THAT(index.like_the_newest(), testing::ElementsAre(123));
  index.add(301, 903.0, place_rows(4711));
  EXPECT_THAT(index.like_the_newest(), testing::IsEmpty());
}

TEST(PlaceIndex, RemembersAPlaceEveryTwoMetresAndNoneOfTheLastThirty) {
  PlaceIndex index({.training_keyframes = 4});
  for (std::size_t k = 0; k < 200; ++k) index.add(k, 0.5 * static_cast<double>(k), place_rows(k));
  EXPECT_LT(index.places(), 60U);
  index.add(200, 100.0, place_rows(180));
  EXPECT_THAT(index.like_the_newest(), testing::Not(testing::Contains(180)));
}

}  // namespace
}  // namespace demslam

#include "demslam/evaluation/association.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// Poses at the given milliseconds; x says which it is.
Trajectory at_ms(const std::vector<int>& times_ms) {
  Trajectory trajectory;
  for (const int t_ms : times_ms) {
    trajectory.push_back({t_ms * TimestampNs{1'000'000}, Pose(Eigen::Quaterniond::Identity(), {1.0 * t_ms, 0.0, 0.0})});
  }
  return trajectory;
}

std::vector<int> times_ms(const Trajectory& trajectory) {
  std::vector<int> times;
  for (const StampedPose& pose : trajectory) times.push_back(static_cast<int>(pose.t_ns / 1'000'000));
  return times;
}

TEST(Association, EachPoseOfTheShorterGetsTheNearestOfTheLonger) {
  const PosePairs pairs = associate(at_ms({0, 4, 100, 109, 200, 300}), at_ms({1, 105, 250}));
  EXPECT_THAT(times_ms(pairs.truth), testing::ElementsAre(0, 109));
  EXPECT_THAT(times_ms(pairs.estimate), testing::ElementsAre(1, 105));
}

TEST(Association, SidesAreKeptWhenTheEstimateIsTheLonger) {
  const PosePairs pairs = associate(at_ms({100}), at_ms({0, 50, 98, 103}));
  EXPECT_THAT(times_ms(pairs.truth), testing::ElementsAre(100));
  EXPECT_THAT(times_ms(pairs.estimate), testing::ElementsAre(98));
}

TEST(Association, TheLimitIsInclusiveAndOfTwoEquallyNearTheEarlierWins) {
  const PosePairs pairs = associate(at_ms({90, 110, 500}), at_ms({100}));
  EXPECT_THAT(times_ms(pairs.truth), testing::ElementsAre(90));
  EXPECT_THAT([] { associate(at_ms({89, 111}), at_ms({100})); },
              ThrowsMessage<Error>(HasSubstr("no pose of the estimate")));
}

TEST(Association, TheOffsetIsAddedToTheEstimate) {
  const AssociationOptions options{.offset_s = 16.7};
  EXPECT_THAT(times_ms(associate(at_ms({16700, 20000}), at_ms({0}), options).truth), testing::ElementsAre(16700));
  EXPECT_THAT(times_ms(associate(at_ms({16700}), at_ms({0, 50}), options).estimate), testing::ElementsAre(0));
}

TEST(Association, ByIndexTheCountsMustAgree) {
  EXPECT_EQ(associate(at_ms({0, 1}), at_ms({500, 600}), {.by_index = true}).truth.size(), 2U);
  EXPECT_THAT([] { associate(at_ms({0, 1}), at_ms({0}), {.by_index = true}); },
              ThrowsMessage<Error>(HasSubstr("the truth has 2 poses and the estimate 1")));
}

TEST(Association, EmptyTrajectoriesAreRefused) {
  EXPECT_THROW(associate({}, at_ms({0})), Error);
  EXPECT_THROW(associate(at_ms({0}), {}), Error);
}

}  // namespace
}  // namespace demslam

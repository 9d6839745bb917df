#include "demslam/evaluation/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::Pair;

/// Poses along x at the given metres, one per second.
Trajectory along_x(const std::vector<double>& metres) {
  Trajectory trajectory;
  for (const double x : metres) {
    const auto t_ns = static_cast<TimestampNs>(trajectory.size()) * 1'000'000'000;
    trajectory.push_back({t_ns, Pose(Eigen::Quaterniond::Identity(), {x, 0.0, 0.0})});
  }
  return trajectory;
}

TEST(Statistics, AreThoseOfNumpy) {
  const ErrorStatistics s = statistics({3.0, 1.0, 2.0, 10.0});
  EXPECT_EQ(s.count, 4U);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(114.0 / 4.0));
  EXPECT_DOUBLE_EQ(s.mean, 4.0);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(50.0 / 4.0));
  EXPECT_DOUBLE_EQ(s.min, 1.0);
  EXPECT_DOUBLE_EQ(s.max, 10.0);
}

TEST(DeltaPairs, ByFrames) {
  const Trajectory t = along_x({0, 1, 2, 3, 4, 5});
  EXPECT_THAT(delta_pairs(t, {.delta = 2}), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(delta_pairs(t, {.delta = 4, .pairs = RpePairs::all}), ElementsAre(Pair(0, 4), Pair(1, 5)));
  EXPECT_TRUE(delta_pairs(t, {.delta = 6}).empty());
}

TEST(DeltaPairs, ByMetresBeginWhereTheFirstDeltaIsComplete) {
  const Trajectory t = along_x({0, 0.6, 1.2, 1.8, 2.4, 3.0});
  EXPECT_THAT(delta_pairs(t, {.delta = 1.0, .unit = DeltaUnit::metres}), ElementsAre(Pair(2, 4)));
}

TEST(DeltaPairs, AllByMetresTakeTheNearestWithinTheTolerance) {
  const Trajectory t = along_x({0, 0.5, 1.02, 1.3, 2.2});
  EXPECT_THAT(delta_pairs(t, {.delta = 1.0, .unit = DeltaUnit::metres, .pairs = RpePairs::all}),
              ElementsAre(Pair(0, 2), Pair(3, 4)));
}

TEST(DeltaPairs, ByMetresFollowThePathAndNotTheDistance) {
  const Trajectory there_and_back = along_x({0, 1, 0, 1, 0});
  EXPECT_THAT(delta_pairs(there_and_back, {.delta = 2.0, .unit = DeltaUnit::metres}), ElementsAre(Pair(2, 4)));
}

TEST(DeltaPairs, BySecondsFollowTheStamps) {
  const Trajectory t = along_x({0, 0, 0, 0, 0});
  EXPECT_THAT(delta_pairs(t, {.delta = 2.0, .unit = DeltaUnit::seconds, .pairs = RpePairs::all}),
              ElementsAre(Pair(0, 2), Pair(1, 3), Pair(2, 4)));
}

TEST(RelativeErrors, ARigidlyMovedTrajectoryHasNone) {
  const Pose offset(rotation_from_rpy(0.3, 0.2, 0.1), {4.0, 5.0, 6.0});
  PosePairs pairs{along_x({0, 1, 3}), along_x({0, 1, 3})};
  for (StampedPose& pose : pairs.estimate) pose.pose = offset * pose.pose;
  EXPECT_THAT(relative_translation_errors(pairs, {{0, 1}, {1, 2}}), testing::Each(testing::Lt(1e-12)));
  EXPECT_THAT(relative_rotation_errors(pairs, {{0, 1}, {1, 2}}), testing::Each(testing::Lt(1e-7)));
}

TEST(RelativeErrors, ATurnIsARotationErrorOfItsAngle) {
  PosePairs pairs{along_x({0, 1}), along_x({0, 1.5})};
  pairs.estimate[1].pose = Pose(rotation_from_rpy(0.0, 0.0, -0.25), pairs.estimate[1].pose.translation());
  EXPECT_NEAR(relative_rotation_errors(pairs, {{0, 1}}).front(), 0.25, 1e-12);
  EXPECT_NEAR(relative_translation_errors(pairs, {{0, 1}}).front(), 0.5, 1e-12);
  EXPECT_NEAR(relative_distance_errors(pairs, {{0, 1}}).front(), 0.5, 1e-12);
}

TEST(PositionErrors, AreTheEstimateMinusTheTruth) {
  const PosePairs pairs{along_x({1}), along_x({3})};
  EXPECT_TRUE(position_errors(pairs, Similarity{}).front().isApprox(Eigen::Vector3d(2.0, 0.0, 0.0)));
}

}  // namespace
}  // namespace demslam

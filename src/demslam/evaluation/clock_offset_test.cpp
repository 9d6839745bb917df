#include "demslam/evaluation/clock_offset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// A figure of eight at a true time; the clock that stamps it runs `behind_s` behind.
Trajectory drive(double from_s, double to_s, double rate_hz, double behind_s) {
  Trajectory trajectory;
  for (double t = from_s; t < to_s; t += 1.0 / rate_hz) {
    const Eigen::Vector3d p(20.0 * std::sin(0.1 * t), 10.0 * std::sin(0.2 * t), 0.02 * t);
    trajectory.push_back({std::llround((t - behind_s) * 1e9), Pose(Eigen::Quaterniond::Identity(), p)});
  }
  return trajectory;
}

TEST(ClockOffset, IsFoundToAFewMilliseconds) {
  Trajectory estimate = drive(20.0, 100.0, 30.0, 16.7);
  const Pose T(rotation_from_rpy(0.1, 0.2, 1.0), {100.0, -50.0, 3.0});
  for (StampedPose& stamped : estimate) stamped.pose = T * stamped.pose;
  const ClockOffset found = estimate_clock_offset(drive(0.0, 120.0, 5.0, 0.0), estimate);
  EXPECT_NEAR(found.offset_s, 16.7, 5e-3);
  EXPECT_LT(found.rmse_m, 0.01);
}

TEST(ClockOffset, TrajectoriesThatNeverOverlapAreRefused) {
  EXPECT_THAT([] { estimate_clock_offset(drive(0.0, 10.0, 5.0, 0.0), drive(500.0, 520.0, 5.0, 0.0)); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("no clock offset can be found")));
}

}  // namespace
}  // namespace demslam

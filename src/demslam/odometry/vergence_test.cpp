#include "demslam/odometry/vergence.h"

#include <gtest/gtest.h>

#include <cmath>

#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

TEST(Vergence, IsKnownAsWellAsTheCamerasAreAligned) {
  const Vergence known = calibrated_vergence({.vergence_sigma_deg = 0.02});
  EXPECT_EQ(known.rad, 0.0);
  EXPECT_NEAR(known.sigma_rad(), 0.02 * kRadPerDeg, 1e-12);
  EXPECT_EQ(calibrated_vergence({.enabled = false}).variance_rad2, 0.0);
}

TEST(Vergence, GrowsVagueWithTheRootOfThePath) {
  const SelfCalibrationOptions options{.vergence_walk_deg_per_sqrt_km = 0.01};
  const double start_rad = 0.03 * kRadPerDeg;
  const Vergence start{.variance_rad2 = start_rad * start_rad};
  EXPECT_NEAR(after_path(start, options, 16000.0).sigma_rad(), 0.05 * kRadPerDeg, 1e-12);
  EXPECT_EQ(after_path({}, options, 1000.0).sigma_rad(), 0.0);
}

TEST(Vergence, CountsMeasurementsThatAreUsedSevenTimesOnce) {
  // One measurement of 0.3 +- 0.1, seen by seven windows in turn.
  const auto with_measurement = [](const Vergence& prior) -> Vergence {
    const double information = 1.0 / prior.variance_rad2 + 100.0;
    return {(prior.rad / prior.variance_rad2 + 0.3 * 100.0) / information, 1.0 / information};
  };
  const Vergence start{0.0, 0.04}, once = with_measurement(start);
  Vergence known = start;
  for (int i = 0; i < 7; ++i) known = learned(known, with_measurement(known), 1.0 / 7.0);
  EXPECT_NEAR(known.rad, once.rad, 1e-9);
  EXPECT_NEAR(known.variance_rad2, once.variance_rad2, 1e-9);
}

TEST(Vergence, IsNotBelievedFarFromTheCalibration) {
  EXPECT_TRUE(plausible({.rad = -0.09 * kRadPerDeg}, {.vergence_sigma_deg = 0.02}));
  EXPECT_FALSE(plausible({.rad = 0.11 * kRadPerDeg}, {.vergence_sigma_deg = 0.02}));
}

TEST(Vergence, IsNotTouchedWhereItIsSure) { EXPECT_EQ(learned({0.1, 0.0}, {0.5, 0.01}, 0.5).rad, 0.1); }

}  // namespace
}  // namespace demslam

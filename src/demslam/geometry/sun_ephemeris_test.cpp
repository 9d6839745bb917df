#include "demslam/geometry/sun_ephemeris.h"
#include "demslam/geometry/angle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "demslam/base/error.h"

namespace demslam {
namespace {

TEST(JulianDay, OfKnownInstants) {
  EXPECT_DOUBLE_EQ(julian_day("2000-01-01T12:00:00Z"), 2451545.0);
  EXPECT_NEAR(julian_day("1957-10-04T19:26:24Z"), 2436116.31, 1e-8);  // Meeus, example 7.a
  EXPECT_DOUBLE_EQ(julian_day("1992-04-12"), 2448724.5);
}

TEST(JulianDay, RefusesWhatIsNoTime) {
  for (const char* text :
       {"", "yesterday", "2026-13-01", "2026-11-25T25:00:00Z", "2026-11-25 12:00", "2026-11-25T12:00:00+01"})
    EXPECT_THROW(julian_day(text), Error) << text;
}

TEST(SubsolarPoint, IsThatOfMeeusExample53a) {
  const SubsolarPoint sun = subsolar_point(julian_day("1992-04-12T00:00:00Z"));
  EXPECT_NEAR(sun.longitude_rad / kRadPerDeg, 67.89, 0.1);
  EXPECT_NEAR(sun.latitude_rad / kRadPerDeg, 1.46, 0.05);
}

TEST(SubsolarPoint, LiesOnTheNearSideAtALunarEclipseAndOnTheFarSideAtASolarOne) {
  for (const char* full : {"2018-07-27T20:21:44Z", "2022-11-08T10:59:11Z", "2025-03-14T06:58:44Z"}) {
    EXPECT_NEAR(subsolar_point(julian_day(full)).longitude_rad / kRadPerDeg, 0.0, 10.0)
        << full;  // librations reach 8 degrees
  }
  for (const char* fresh : {"2017-08-21T18:25:32Z", "2024-04-08T18:17:16Z"}) {
    EXPECT_GT(std::abs(subsolar_point(julian_day(fresh)).longitude_rad) / kRadPerDeg, 170.0) << fresh;
  }
}

/// Values of J. Scotti, "Sun and Earth: Altitudes and Azimuths at the Apollo Landing Sites", Apollo Lunar Surface
/// Journal, which states agreement of two ephemerides to 0.5 degrees.
TEST(SunDirection, HasThePublishedElevationAndAzimuthOverTheFirstTwoApolloSites) {
  struct Sight {
    const char* utc;
    double longitude_deg, latitude_deg, elevation_deg, azimuth_from_north_deg;
  };
  for (const Sight& sight : {Sight{"1969-07-20T20:17:39Z", 23.4333, 0.6875, 10.65, 88.81},
                             Sight{"1969-07-21T17:54:00Z", 23.4333, 0.6875, 21.65, 88.91},
                             Sight{"1969-11-19T06:54:36Z", -23.3856, -3.1975, 5.19, 91.16},
                             Sight{"1969-11-20T14:25:47Z", -23.3856, -3.1975, 21.11, 90.33}}) {
    const Eigen::Vector3d sun =
        sun_direction_enu(julian_day(sight.utc), sight.longitude_deg * kRadPerDeg, sight.latitude_deg * kRadPerDeg);
    EXPECT_NEAR(std::asin(sun.z()) / kRadPerDeg, sight.elevation_deg, 0.5) << sight.utc;
    EXPECT_NEAR(std::atan2(sun.x(), sun.y()) / kRadPerDeg, sight.azimuth_from_north_deg, 0.5) << sight.utc;
    EXPECT_NEAR(sun.norm(), 1.0, 1e-12);
  }
}

TEST(SunDirection, GoesRoundOncePerSynodicMonth) {
  const double start = julian_day("2026-01-01");
  EXPECT_NEAR(std::acos(sun_direction(start).dot(sun_direction(start + 29.530589))) / kRadPerDeg, 0.0, 2.0);
  EXPECT_NEAR(std::acos(sun_direction(start).dot(sun_direction(start + 14.765))) / kRadPerDeg, 180.0, 4.0);
}

}  // namespace
}  // namespace demslam

#include "demslam/geometry/sun_ephemeris.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

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
  EXPECT_NEAR(sun.longitude_rad / kDeg, 67.89, 0.1);
  EXPECT_NEAR(sun.latitude_rad / kDeg, 1.46, 0.05);
}

TEST(SubsolarPoint, LiesOnTheNearSideAtALunarEclipseAndOnTheFarSideAtASolarOne) {
  for (const char* full : {"2018-07-27T20:21:44Z", "2022-11-08T10:59:11Z", "2025-03-14T06:58:44Z"}) {
    EXPECT_NEAR(subsolar_point(julian_day(full)).longitude_rad / kDeg, 0.0, 10.0)
        << full;  // librations reach 8 degrees
  }
  for (const char* fresh : {"2017-08-21T18:25:32Z", "2024-04-08T18:17:16Z"}) {
    EXPECT_GT(std::abs(subsolar_point(julian_day(fresh)).longitude_rad) / kDeg, 170.0) << fresh;
  }
}

/// Sun elevations at the Apollo landings (Orloff, Apollo by the Numbers, NASA SP-2000-4029: "Sun elevation at
/// landing").
TEST(SunDirection, HasThePublishedElevationAtEveryApolloLanding) {
  struct Landing {
    const char* utc;
    double latitude_deg, longitude_deg, elevation_deg;
  };
  for (const Landing& landing :
       {Landing{"1969-07-20T20:17:40Z", 0.674, 23.473, 10.8}, Landing{"1969-11-19T06:54:36Z", -3.012, -23.422, 5.1},
        Landing{"1971-02-05T09:18:13Z", -3.645, -17.471, 10.3}, Landing{"1971-07-30T22:16:29Z", 26.132, 3.634, 12.2},
        Landing{"1972-04-21T02:23:35Z", -8.973, 15.500, 11.9}, Landing{"1972-12-11T19:54:58Z", 20.191, 30.772, 13.3}}) {
    const Eigen::Vector3d sun =
        sun_direction_enu(julian_day(landing.utc), landing.longitude_deg * kDeg, landing.latitude_deg * kDeg);
    EXPECT_NEAR(std::asin(sun.z()) / kDeg, landing.elevation_deg, 0.5) << landing.utc;
    EXPECT_GT(sun.x(), 0.9) << "morning: the sun stands in the East";
    EXPECT_NEAR(sun.norm(), 1.0, 1e-12);
  }
}

TEST(SunDirection, GoesRoundOncePerSynodicMonth) {
  const double start = julian_day("2026-01-01");
  EXPECT_NEAR(std::acos(sun_direction(start).dot(sun_direction(start + 29.530589))) / kDeg, 0.0, 2.0);
  EXPECT_NEAR(std::acos(sun_direction(start).dot(sun_direction(start + 14.765))) / kDeg, 180.0, 4.0);
}

}  // namespace
}  // namespace demslam

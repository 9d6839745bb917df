#include "demslam/geometry/sun_ephemeris.h"

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "demslam/base/error.h"
#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

constexpr double kEquatorTilt = 1.54242 * kRadPerDeg;   // of the Moon's mean equator against the ecliptic
constexpr double kDynamicalTimeAhead = 65.0 / 86400.0;  // days; 32 s in 1955, 69 s in 2020
constexpr double kAstronomicalUnit = 149597870.7;       // km

double degrees(double value) { return std::fmod(value, 360.0) * kRadPerDeg; }

/// Mean angles of sun and Moon, radians (Meeus 25.2, 25.3, 47.1 to 47.5, 47.7), `t` Julian centuries since J2000.
struct MeanAngles {
  explicit MeanAngles(double t)
      : sun_longitude(degrees(280.46646 + 36000.76983 * t)),
        sun_anomaly(degrees(357.52911 + 35999.05029 * t)),
        moon_longitude(degrees(218.3164477 + 481267.88123421 * t)),
        elongation(degrees(297.8501921 + 445267.1114034 * t)),
        moon_anomaly(degrees(134.9633964 + 477198.8675055 * t)),
        argument_of_latitude(degrees(93.2720950 + 483202.0175233 * t)),
        node(degrees(125.0445479 - 1934.1362891 * t)) {}

  double sun_longitude, sun_anomaly, moon_longitude, elongation, moon_anomaly, argument_of_latitude, node;
};

struct Ecliptic {
  double longitude, latitude, distance_km;
};

Ecliptic sun_from_earth(const MeanAngles& a) {
  const double centre = (1.914602 * std::sin(a.sun_anomaly) + 0.019993 * std::sin(2.0 * a.sun_anomaly) +
                         0.000289 * std::sin(3.0 * a.sun_anomaly)) *
                        kRadPerDeg;
  const double aberration = 0.00569 * kRadPerDeg, eccentricity = 0.016708634;
  const double distance =
      1.000001018 * (1.0 - eccentricity * eccentricity) / (1.0 + eccentricity * std::cos(a.sun_anomaly + centre));
  return {a.sun_longitude + centre - aberration, 0.0, distance * kAstronomicalUnit};
}

/// The largest terms of Meeus' tables 47.A and 47.B. The sun is 389 times as far, so that an error here counts little.
Ecliptic moon_from_earth(const MeanAngles& a) {
  const double m = a.moon_anomaly, d = a.elongation, f = a.argument_of_latitude;
  const double longitude = 6.288774 * std::sin(m) + 1.274027 * std::sin(2.0 * d - m) + 0.658314 * std::sin(2.0 * d) +
                           0.213618 * std::sin(2.0 * m) - 0.185116 * std::sin(a.sun_anomaly) -
                           0.114332 * std::sin(2.0 * f);
  const double latitude = 5.128122 * std::sin(f) + 0.280602 * std::sin(m + f) + 0.277693 * std::sin(m - f) +
                          0.173237 * std::sin(2.0 * d - f);
  const double distance =
      385000.56 - 20905.355 * std::cos(m) - 3699.111 * std::cos(2.0 * d - m) - 2955.968 * std::cos(2.0 * d);
  return {a.moon_longitude + longitude * kRadPerDeg, latitude * kRadPerDeg, distance};
}

[[noreturn]] void not_a_time(std::string_view utc) {
  throw Error("'" + std::string(utc) + "' is no UTC time; write it as 2026-11-25T12:00:00Z");
}

}  // namespace

double julian_day(std::string_view utc) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, read = 0;
  double second = 0.0;
  const std::string text(utc);
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%n", &year, &month, &day, &read) != 3) not_a_time(utc);
  std::string_view rest = std::string_view(text).substr(static_cast<std::size_t>(read));
  if (!rest.empty() && rest.back() == 'Z') rest.remove_suffix(1);
  if (!rest.empty()) {
    int used = 0;
    const std::string time(rest);
    if (std::sscanf(time.c_str(), "T%2d:%2d:%lf%n", &hour, &minute, &second, &used) != 3) not_a_time(utc);
    if (used != static_cast<int>(time.size())) not_a_time(utc);
  }
  const bool valid = month >= 1 && month <= 12 && day >= 1 && day <= 31 && hour >= 0 && hour < 24 && minute >= 0 &&
                     minute < 60 && second >= 0.0 && second < 61.0;
  if (!valid) not_a_time(utc);
  if (month <= 2) month += 12, --year;  // Meeus 7.1
  const int century = year / 100;
  return std::floor(365.25 * (year + 4716)) + std::floor(30.6001 * (month + 1)) + day + 2 - century + century / 4 -
         1524.5 + (hour + (minute + second / 60.0) / 60.0) / 24.0;
}

SubsolarPoint subsolar_point(double julian_day) {
  const MeanAngles angles((julian_day + kDynamicalTimeAhead - 2451545.0) / 36525.0);
  const Ecliptic sun = sun_from_earth(angles), moon = moon_from_earth(angles);
  const double nearness = moon.distance_km / sun.distance_km;
  // The Moon as seen from the sun, plus 180 degrees (chapter 53, "the altitude of the Sun").
  const double longitude =
      sun.longitude + std::numbers::pi + nearness * std::cos(moon.latitude) * std::sin(sun.longitude - moon.longitude);
  const double latitude = nearness * moon.latitude;
  const double w = longitude - angles.node, cos_tilt = std::cos(kEquatorTilt), sin_tilt = std::sin(kEquatorTilt);
  const double a = std::atan2(std::sin(w) * std::cos(latitude) * cos_tilt - std::sin(latitude) * sin_tilt,
                              std::cos(w) * std::cos(latitude));
  return {std::remainder(a - angles.argument_of_latitude, 2.0 * std::numbers::pi),
          std::asin(-std::sin(w) * std::cos(latitude) * sin_tilt - std::sin(latitude) * cos_tilt)};
}

Eigen::Vector3d sun_direction(double julian_day) {
  const auto [longitude, latitude] = subsolar_point(julian_day);
  return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
}

Eigen::Vector3d sun_direction_enu(double julian_day, double longitude_rad, double latitude_rad) {
  const double cl = std::cos(longitude_rad), sl = std::sin(longitude_rad);
  const double cb = std::cos(latitude_rad), sb = std::sin(latitude_rad);
  Eigen::Matrix3d enu_from_moon;
  enu_from_moon << -sl, cl, 0.0, -sb * cl, -sb * sl, cb, cb * cl, cb * sl, sb;
  return enu_from_moon * sun_direction(julian_day);
}

}  // namespace demslam

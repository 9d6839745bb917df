#pragma once

#include <Eigen/Core>
#include <string_view>

namespace demslam {

/// Where on the Moon the sun stands in the zenith: selenographic (mean Earth / polar axis), radians, East positive.
struct SubsolarPoint {
  double longitude_rad = 0.0;  ///< in [-pi, pi)
  double latitude_rad = 0.0;
};

/// Julian day (UTC) of "2026-11-25T12:00:00Z"; seconds may have a fraction, time and Z may be left out. Throws Error.
double julian_day(std::string_view utc);

/// Meeus, Astronomical Algorithms (2nd ed.), chapters 25, 47 and 53: the sun's low-precision position and the Moon's
/// optical librations seen from the sun. Left out: nutation, physical librations, planetary terms, leap seconds.
/// Compared with Meeus' example 53.a (1992) and with the sun published for two Apollo sites (1969): within 0.05 degree.
SubsolarPoint subsolar_point(double julian_day);

/// Unit vector to the sun in Moon-fixed axes (x: 0 E 0 N, z: North pole). Its parallax across the Moon is below 0.001
/// degree.
Eigen::Vector3d sun_direction(double julian_day);

/// Unit vector to the sun in the East-North-Up axes of a place (planetocentric, radians).
Eigen::Vector3d sun_direction_enu(double julian_day, double longitude_rad, double latitude_rad);

}  // namespace demslam

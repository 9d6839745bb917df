#include "demslam/sim/sun_position.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "demslam/base/error.h"
#include "demslam/geometry/angle.h"
#include "demslam/geometry/sun_ephemeris.h"

namespace demslam {
namespace {

Eigen::Vector3d moon_fixed(const Eigen::Vector3d& lon_lat_height) {
  return sky_direction(lon_lat_height.y(), lon_lat_height.x());
}

/// Rows: the map's axes at its origin, in Moon-fixed axes.
Eigen::Matrix3d map_axes(const LocalFrame& frame, const LightOptions& light) {
  Eigen::Matrix3d axes;
  if (frame.crs_wkt.empty()) {
    const double lon = light.longitude_deg * kRadPerDeg, lat = light.latitude_deg * kRadPerDeg;
    axes << -std::sin(lon), std::cos(lon), 0.0, -std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon),
        std::cos(lat), std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat);
    return axes;
  }
  constexpr double kStep = 100.0;  // metres: far enough for the arithmetic, near enough for the curvature
  const Georeference georeference(frame);
  const auto place = [&](double x, double y) { return moon_fixed(georeference.lon_lat_height({x, y, 0.0})); };
  const Eigen::Vector3d up = place(0.0, 0.0), towards_y = place(0.0, kStep) - place(0.0, -kStep);
  const Eigen::Vector3d north = (towards_y - up * up.dot(towards_y)).normalized();
  axes << north.cross(up).transpose(), north.transpose(), up.transpose();
  return axes;
}

}  // namespace

Eigen::Vector3d sky_direction(double elevation_deg, double azimuth_deg) {
  const double elevation = elevation_deg * kRadPerDeg, azimuth = azimuth_deg * kRadPerDeg;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
}

LightOptions light_at_time(LightOptions light, const LocalFrame& frame) {
  if (light.utc.empty()) return light;
  const Eigen::Vector3d sun = map_axes(frame, light) * sun_direction(julian_day(light.utc));
  light.sun_elevation_deg = std::asin(sun.z()) / kRadPerDeg;
  light.sun_azimuth_deg = std::atan2(sun.y(), sun.x()) / kRadPerDeg;
  if (light.sun_elevation_deg > 0.0) return light;
  char text[160];
  std::snprintf(text, sizeof text,
                "at %s the sun is %.1f degrees below the horizon of the scene; choose another 'utc' or place",
                light.utc.c_str(), -light.sun_elevation_deg);
  throw Error(text);
}

}  // namespace demslam

#include "demslam/sim/glare.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <numbers>

#include "demslam/geometry/angle.h"
#include "demslam/sim/lens.h"
#include "demslam/sim/sun_position.h"

namespace demslam {
namespace {

constexpr double kMinCosine = 0.17;  // a sun farther than 80 degrees off the axis does not reach the lens

Eigen::Vector3d sun_in_camera(const LightOptions& light, const Pose& T_map_camera) {
  return T_map_camera.rotation().conjugate() * sky_direction(light.sun_elevation_deg, light.sun_azimuth_deg);
}

/// Share of the rays to points of the sun's disc that meet nothing.
double seen_share(const Renderer& renderer, const Pose& T_map_camera, const Eigen::Vector3d& sun, double radius) {
  const Eigen::Vector3d right = radius * sun.unitOrthogonal(), up = sun.cross(right);
  std::array<Eigen::Vector3d, kPacket> directions;
  for (int i = 0; i < kPacket; ++i) {
    const double r = std::sqrt((i + 0.5) / kPacket), angle = 2.39996323 * i;
    directions[i] = sun + r * std::cos(angle) * right + r * std::sin(angle) * up;
  }
  double free = 0.0;
  for (const RangeReturn& back : renderer.cast(T_map_camera, directions)) free += back.surface == Surface::sky;
  return free / kPacket;
}

/// A bright disc with a soft edge.
struct Spot {
  Eigen::Vector2d centre;
  double radius_px;
  float light;

  float at(int u, int v) const {
    const double distance = std::hypot(u - centre.x(), v - centre.y());
    return light * static_cast<float>(std::fmin(std::fmax(radius_px - distance + 0.5, 0.0), 1.0));
  }
};

std::array<Spot, 4> ghosts(const Camera& camera, const SunInView& sun, double flare) {
  const Eigen::Vector2d middle(camera.cx, camera.cy), away = middle - sun.pixel;
  const auto light = static_cast<float>(0.01 * flare * sun.seen);
  std::array<Spot, 4> spots;
  const double along[] = {-0.45, 0.35, 0.8, 1.3}, radius[] = {0.012, 0.03, 0.02, 0.05};
  for (int k = 0; k < 4; ++k) spots[k] = {middle + along[k] * away, radius[k] * camera.width, light};
  return spots;
}

void add_flare(Rendering& rendering, const Camera& camera, const SunInView& sun, double flare) {
  const std::array<Spot, 4> spots = ghosts(camera, sun, flare);
  const double veil = 0.3 * flare * std::numbers::pi * sun.seen, deg_per_px = 1.0 / (kRadPerDeg * camera.fx);
  tbb::parallel_for(0, rendering.height, [&](int v) {
    for (int u = 0; u < rendering.width; ++u) {
      const double angle_deg = deg_per_px * std::hypot(u - sun.pixel.x(), v - sun.pixel.y());
      float& light = rendering.radiance[static_cast<std::size_t>(v) * rendering.width + u];
      light += static_cast<float>(veil / (angle_deg * angle_deg + 1.0));
      for (const Spot& spot : spots) light += spot.at(u, v);
    }
  });
}

}  // namespace

SunInView find_sun(const Renderer& renderer, const LightOptions& light, const Camera& camera,
                   const Pose& T_map_camera) {
  const Eigen::Vector3d sun = sun_in_camera(light, T_map_camera);
  SunInView view;
  if (sun.z() < kMinCosine || light.sun_diameter_deg <= 0.0) return view;
  const double radius = 0.5 * light.sun_diameter_deg * kRadPerDeg;
  view.pixel = distorted(camera, sun.head<2>() / sun.z()).cwiseProduct(Eigen::Vector2d(camera.fx, camera.fy)) +
               Eigen::Vector2d(camera.cx, camera.cy);
  view.radius_px = camera.fx * radius;
  view.seen = seen_share(renderer, T_map_camera, sun, radius);
  return view;
}

void add_sun(Rendering& rendering, const Camera& camera, const LightOptions& light, const SunInView& sun,
             double flare) {
  if (sun.seen <= 0.0) return;
  const double sine = std::sin(0.5 * light.sun_diameter_deg * kRadPerDeg);
  const Spot disc{sun.pixel, sun.radius_px, static_cast<float>(1.0 / (sine * sine))};
  const int reach = static_cast<int>(std::ceil(sun.radius_px)) + 1,
            middle_u = static_cast<int>(std::lround(sun.pixel.x())),
            middle_v = static_cast<int>(std::lround(sun.pixel.y()));
  for (int v = std::max(middle_v - reach, 0); v <= std::min(middle_v + reach, rendering.height - 1); ++v) {
    for (int u = std::max(middle_u - reach, 0); u <= std::min(middle_u + reach, rendering.width - 1); ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * rendering.width + u;
      if (rendering.surface[i] == Surface::sky) rendering.radiance[i] += disc.at(u, v);
    }
  }
  if (flare > 0.0) add_flare(rendering, camera, sun, flare);
}

}  // namespace demslam

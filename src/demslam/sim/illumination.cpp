#include "demslam/sim/illumination.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "demslam/base/random.h"

namespace demslam {
namespace {

using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kSunRays = 4;  // over the sun's disc, where a packet lies on the edge of a shadow
constexpr float kReliefViewFactor = 0.02F;

Vector3f sun_direction(const LightOptions& light) {
  const double elevation = light.sun_elevation_deg * std::numbers::pi / 180.0;
  const double azimuth = light.sun_azimuth_deg * std::numbers::pi / 180.0;
  return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation))
      .cast<float>();
}

/// Casts shadow rays; returns for each lane whether its way is free.
void cast_shadows(RTCScene scene, const int* valid, RTCRay8& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
}

/// Point `sample` of a sunflower pattern over the unit disc, turned by a random angle.
Eigen::Vector2f disc_point(int sample, std::uint64_t word) {
  const float turn = static_cast<float>(Random::mix(word) >> 40) * 0x1.0p-24F * 2.0F * std::numbers::pi_v<float>;
  const float radius = std::sqrt((static_cast<float>(sample) + 0.5F) / kSunRays);
  const float angle = turn + 2.39996323F * static_cast<float>(sample);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

Vector3f shadow_start(const Hit& hit) { return hit.position + hit.offset * hit.normal; }

}  // namespace

void set_ray(RTCRay8& rays, int i, const Vector3f& origin, const Vector3f& direction, float near, float far) {
  rays.org_x[i] = origin.x();
  rays.org_y[i] = origin.y();
  rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x();
  rays.dir_y[i] = direction.y();
  rays.dir_z[i] = direction.z();
  rays.tnear[i] = near;
  rays.tfar[i] = far;
  rays.time[i] = 0.0F;
  rays.mask[i] = ~0U;
  rays.id[i] = 0;
  rays.flags[i] = 0;
}

Illumination::Illumination(const LightOptions& light)
    : reflectance_(light.photometry, light.albedo),
      sun_(sun_direction(light)),
      disc_(light.sun_diameter_deg > 0.0),
      fill_(static_cast<float>(light.fill * light.albedo * light.albedo) * sun_.z()),
      lamp_(static_cast<float>(light.lamp)) {
  const auto radius = static_cast<float>(std::tan(0.5 * light.sun_diameter_deg * std::numbers::pi / 180.0));
  sun_right_ = radius * sun_.unitOrthogonal();
  sun_up_ = sun_.cross(sun_right_);
}

void Illumination::light(RTCScene scene, const int* valid, const Hit* hits, std::uint64_t key, const Vector3f& lamp,
                         float* radiance) const {
  for (int i = 0; i < kPacket; ++i) {
    const float view_factor = valid[i] != 0 ? 0.5F * (1.0F - hits[i].normal.z()) + kReliefViewFactor : 0.0F;
    radiance[i] = view_factor > 0.0F ? fill_ * view_factor * hits[i].albedo : 0.0F;
  }
  sunlight(scene, valid, hits, key, radiance);
  if (lamp_ > 0.0F) lamplight(scene, valid, hits, lamp, radiance);
}

void Illumination::probe_sun(RTCScene scene, const int* facing, const Hit* hits, std::uint64_t key, int sample,
                             float* free) const {
  alignas(32) RTCRay8 rays;
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] == 0) continue;
    Vector3f direction = sun_;
    if (disc_) {
      const Eigen::Vector2f point = disc_point(sample, key + static_cast<std::uint64_t>(i));
      direction += point.x() * sun_right_ + point.y() * sun_up_;
    }
    set_ray(rays, i, shadow_start(hits[i]), direction, hits[i].offset, kInfinity);
  }
  cast_shadows(scene, facing, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] != 0 && rays.tfar[i] >= 0.0F) free[i] += 1.0F;
  }
}

/// One ray to the sun per hit; a packet that is neither all lit nor all dark then looks at the whole disc.
void Illumination::sunlight(RTCScene scene, const int* valid, const Hit* hits, std::uint64_t key,
                            float* radiance) const {
  alignas(32) int facing[kPacket];
  float free[kPacket] = {}, lit = 0.0F, count = 0.0F, rays = 1.0F;
  for (int i = 0; i < kPacket; ++i) {
    facing[i] = valid[i] != 0 && hits[i].normal.dot(sun_) > 0.0F ? -1 : 0;
    count += facing[i] != 0 ? 1.0F : 0.0F;
  }
  if (count == 0.0F) return;
  constexpr int kFirst = kSunRays / 2;
  probe_sun(scene, facing, hits, key, kFirst, free);
  for (const float value : free) lit += value;
  if (disc_ && lit > 0.0F && lit < count) {
    rays = kSunRays;
    for (int sample = 0; sample < kSunRays; ++sample) {
      if (sample != kFirst) probe_sun(scene, facing, hits, key, sample, free);
    }
  }
  for (int i = 0; i < kPacket; ++i) {
    if (free[i] == 0.0F) continue;
    const Hit& hit = hits[i];
    const float bright = reflectance_(hit.normal.dot(sun_), hit.normal.dot(hit.to_eye), hit.to_eye.dot(sun_));
    radiance[i] += free[i] / rays * hit.albedo * bright;
  }
}

void Illumination::lamplight(RTCScene scene, const int* valid, const Hit* hits, const Vector3f& lamp,
                             float* radiance) const {
  alignas(32) int facing[kPacket];
  alignas(32) RTCRay8 rays;
  for (int i = 0; i < kPacket; ++i) {
    facing[i] = valid[i] != 0 && hits[i].normal.dot(lamp - hits[i].position) > 0.0F ? -1 : 0;
    if (facing[i] != 0) set_ray(rays, i, shadow_start(hits[i]), lamp - shadow_start(hits[i]), 1e-3F, 1.0F);
  }
  cast_shadows(scene, facing, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] == 0 || rays.tfar[i] < 0.0F) continue;
    const Hit& hit = hits[i];
    const Vector3f path = lamp - hit.position, to_lamp = path.normalized();
    const float bright = reflectance_(hit.normal.dot(to_lamp), hit.normal.dot(hit.to_eye), hit.to_eye.dot(to_lamp));
    radiance[i] += lamp_ / path.squaredNorm() * hit.albedo * bright;
  }
}

}  // namespace demslam

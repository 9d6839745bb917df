#include "demslam/sim/illumination.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/sim/sun_position.h"

namespace demslam {
namespace {

using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kSunRays = 4;  // over the sun's disc, where a packet lies on the edge of a shadow
constexpr float kReliefViewFactor = 0.02F;
constexpr float kBefore = 2.0F;  // metres before a slope lies the ground that lights it

constexpr double kFullEarth = 0.367 * (6371.0 / 384400.0) * (6371.0 / 384400.0);

constexpr int kTurns = 256;

/// A sunflower pattern of points on the unit disc, turned by each of a circle's angles.
struct DiscPoints {
  DiscPoints() {
    for (int turn = 0; turn < kTurns; ++turn) {
      for (int sample = 0; sample < kSunRays; ++sample) {
        const double angle = 2.0 * std::numbers::pi * turn / kTurns + 2.39996323 * sample;
        const double radius = std::sqrt((sample + 0.5) / kSunRays);
        at[turn][sample] = Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle)).cast<float>();
      }
    }
  }
  Eigen::Vector2f at[kTurns][kSunRays];
};

const Eigen::Vector2f& disc_point(int sample, std::uint64_t word) {
  static const DiscPoints points;
  return points.at[Random::mix(word) >> 56][sample];
}

Vector3f at(const Triples& triples, int i) { return {triples.x[i], triples.y[i], triples.z[i]}; }

Vector3f shadow_start(const Hits& hits, int i) { return at(hits.position, i) + hits.offset[i] * at(hits.normal, i); }

/// Cosines of the angles between a packet's directions and one direction.
void cosines(const Triples& directions, const Vector3f& to, float* out) {
  for (int i = 0; i < kPacket; ++i)
    out[i] = directions.x[i] * to.x() + directions.y[i] * to.y() + directions.z[i] * to.z();
}

/// Rays from the hits into one direction.
RTCRay16 shadow_rays(const Hits& hits, const Vector3f& direction) {
  RTCRay16 rays;
  for (int i = 0; i < kPacket; ++i) {
    rays.org_x[i] = hits.position.x[i] + hits.offset[i] * hits.normal.x[i];
    rays.org_y[i] = hits.position.y[i] + hits.offset[i] * hits.normal.y[i];
    rays.org_z[i] = hits.position.z[i] + hits.offset[i] * hits.normal.z[i];
    rays.dir_x[i] = direction.x();
    rays.dir_y[i] = direction.y();
    rays.dir_z[i] = direction.z();
    rays.tnear[i] = hits.offset[i];
    rays.tfar[i] = kInfinity;
    rays.time[i] = 0.0F;
    rays.mask[i] = ~0U;
    rays.id[i] = rays.flags[i] = 0;
  }
  return rays;
}

}  // namespace

void set_ray(RTCRay16& rays, int i, const Vector3f& origin, const Vector3f& direction, float near, float far) {
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

void cast_shadows(RTCScene scene, const int* valid, RTCRay16& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &rays, &arguments);
}

Illumination::Illumination(const LightOptions& light)
    : reflectance_(light.photometry, light.albedo, light.soil),
      sun_(sky_direction(light.sun_elevation_deg, light.sun_azimuth_deg).cast<float>()),
      disc_(static_cast<float>(light.sun_diameter_deg * std::numbers::pi / 180.0)),
      fill_(static_cast<float>(light.fill * light.albedo * light.albedo) * sun_.z()),
      lamp_(static_cast<float>(light.lamp)),
      earth_(sky_direction(light.earth_elevation_deg, light.earth_azimuth_deg).cast<float>()),
      earthshine_(static_cast<float>(light.earthshine * kFullEarth)) {
  sun_right_ = std::tan(0.5F * disc_) * sun_.unitOrthogonal();
  sun_up_ = sun_.cross(sun_right_);
}

void Illumination::light(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key, const Vector3f& lamp,
                         float* radiance, Sunlight* sun) const {
  groundlight(valid, hits, radiance);
  sunlight(scene, valid, hits, key, radiance, sun);
  other_light(scene, valid, hits, lamp, radiance);
}

void Illumination::light_further(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key,
                                 const Vector3f& lamp, float* radiance) const {
  groundlight(valid, hits, radiance);
  alignas(64) int facing[kPacket];
  float mu0[kPacket], free[kPacket] = {};
  if (turn_to_sun(valid, hits, mu0, facing)) {
    Eigen::Vector2f points[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      points[i] = disc_point(i % kSunRays, key + static_cast<std::uint64_t>(i / kSunRays));
    }
    probe_sun(scene, facing, hits, points, free);
    reflect(hits, mu0, free, radiance);
  }
  other_light(scene, valid, hits, lamp, radiance);
}

void Illumination::other_light(RTCScene scene, const int* valid, const Hits& hits, const Vector3f& lamp,
                               float* radiance) const {
  if (earthshine_ > 0.0F) earthlight(scene, valid, hits, radiance);
  if (lamp_ > 0.0F) lamplight(scene, valid, hits, lamp, radiance);
}

void Illumination::light_unbroken(const int* valid, const Hits& hits, bool is_lit, float* radiance) const {
  groundlight(valid, hits, radiance);
  if (!is_lit) return;
  int facing[kPacket];
  float mu0[kPacket], share[kPacket];
  turn_to_sun(valid, hits, mu0, facing);
  for (int i = 0; i < kPacket; ++i) share[i] = facing[i] != 0 ? 1.0F : 0.0F;
  reflect(hits, mu0, share, radiance);
}

void Illumination::groundlight(const int* valid, const Hits& hits, float* radiance) const {
  for (int i = 0; i < kPacket; ++i) {
    radiance[i] = 0.0F;
    if (valid[i] == 0 || fill_ <= 0.0F) continue;
    const float view_factor = 0.5F * (1.0F - hits.normal.z[i]) + kReliefViewFactor;
    const float brightness =
        ground_.at(hits.position.x[i] + kBefore * hits.normal.x[i], hits.position.y[i] + kBefore * hits.normal.y[i]);
    radiance[i] = fill_ * view_factor * brightness * hits.albedo[i];
  }
}

/// Cosines of incidence, and the lanes that face the sun; whether there are any.
bool Illumination::turn_to_sun(const int* valid, const Hits& hits, float* mu0, int* facing) const {
  cosines(hits.normal, sun_, mu0);
  bool any = false;
  for (int i = 0; i < kPacket; ++i) {
    facing[i] = valid[i] != 0 && mu0[i] > 0.0F ? -1 : 0;
    any |= facing[i] != 0;
  }
  return any;
}

void Illumination::probe_sun(RTCScene scene, const int* facing, const Hits& hits, const Eigen::Vector2f* points,
                             float* free) const {
  RTCRay16 rays = shadow_rays(hits, sun_);
  for (int i = 0; i < kPacket && disc_ > 0.0F; ++i) {
    const Eigen::Vector2f& point = points[i];
    rays.dir_x[i] += point.x() * sun_right_.x() + point.y() * sun_up_.x();
    rays.dir_y[i] += point.x() * sun_right_.y() + point.y() * sun_up_.y();
    rays.dir_z[i] += point.x() * sun_right_.z() + point.y() * sun_up_.z();
  }
  cast_shadows(scene, facing, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] != 0 && rays.tfar[i] >= 0.0F) free[i] += 1.0F;
  }
}

bool Illumination::penumbra_shows(RTCScene scene, const int* shadowed, const Hits& hits) const {
  alignas(64) RTCRay16 rays = shadow_rays(hits, sun_);
  for (int i = 0; i < kPacket; ++i) rays.tfar[i] = 0.5F * hits.footprint[i] / disc_;
  cast_shadows(scene, shadowed, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (shadowed[i] != 0 && rays.tfar[i] >= 0.0F) return true;
  }
  return false;
}

/// One ray to the sun per hit; a packet on the edge of a shadow that is soft enough then looks at the whole disc.
void Illumination::sunlight(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key, float* radiance,
                            Sunlight* sun) const {
  alignas(64) int facing[kPacket], shadowed[kPacket];
  float mu0[kPacket], free[kPacket] = {}, rays = 1.0F;
  std::fill_n(sun, kPacket, Sunlight::turned_away);
  if (!turn_to_sun(valid, hits, mu0, facing)) return;
  const auto probe = [&](int sample) {
    Eigen::Vector2f points[kPacket];
    for (int i = 0; i < kPacket; ++i) points[i] = disc_point(sample, key + static_cast<std::uint64_t>(i));
    probe_sun(scene, facing, hits, points, free);
  };
  constexpr int kFirst = kSunRays / 2;
  probe(kFirst);
  bool some_dark = false, some_lit = false;
  for (int i = 0; i < kPacket; ++i) {
    shadowed[i] = facing[i] != 0 && free[i] == 0.0F ? -1 : 0;
    if (shadowed[i] != 0) sun[i] = Sunlight::shadowed;
    some_dark |= shadowed[i] != 0;
    some_lit |= free[i] != 0.0F;
  }
  if (!some_lit) return;
  if (disc_ > 0.0F && some_dark && penumbra_shows(scene, shadowed, hits)) {
    rays = kSunRays;
    for (int sample = 0; sample < kSunRays; ++sample) {
      if (sample != kFirst) probe(sample);
    }
  }
  for (int i = 0; i < kPacket; ++i) {
    if (free[i] > 0.0F) sun[i] = free[i] == rays ? Sunlight::lit : Sunlight::partly;
    free[i] /= rays;
  }
  reflect(hits, mu0, free, radiance);
}

void Illumination::reflect(const Hits& hits, const float* mu0, const float* share, float* radiance) const {
  float mu[kPacket], cos_phase[kPacket];
  dot(hits.normal, hits.to_eye, mu);
  cosines(hits.to_eye, sun_, cos_phase);
  for (int i = 0; i < kPacket; ++i) {
    if (share[i] > 0.0F) radiance[i] += share[i] * hits.albedo[i] * reflectance_(mu0[i], mu[i], cos_phase[i]);
  }
}

void Illumination::earthlight(RTCScene scene, const int* valid, const Hits& hits, float* radiance) const {
  alignas(64) int facing[kPacket];
  for (int i = 0; i < kPacket; ++i) facing[i] = valid[i] != 0 && at(hits.normal, i).dot(earth_) > 0.0F ? -1 : 0;
  alignas(64) RTCRay16 rays = shadow_rays(hits, earth_);
  cast_shadows(scene, facing, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] == 0 || rays.tfar[i] < 0.0F) continue;
    const Vector3f normal = at(hits.normal, i), to_eye = at(hits.to_eye, i);
    radiance[i] +=
        earthshine_ * hits.albedo[i] * reflectance_(normal.dot(earth_), normal.dot(to_eye), to_eye.dot(earth_));
  }
}

void Illumination::lamplight(RTCScene scene, const int* valid, const Hits& hits, const Vector3f& lamp,
                             float* radiance) const {
  alignas(64) int facing[kPacket];
  alignas(64) RTCRay16 rays;
  for (int i = 0; i < kPacket; ++i) {
    facing[i] = valid[i] != 0 && at(hits.normal, i).dot(lamp - at(hits.position, i)) > 0.0F ? -1 : 0;
    if (facing[i] != 0) set_ray(rays, i, shadow_start(hits, i), lamp - shadow_start(hits, i), 1e-3F, 1.0F);
  }
  cast_shadows(scene, facing, rays);
  for (int i = 0; i < kPacket; ++i) {
    if (facing[i] == 0 || rays.tfar[i] < 0.0F) continue;
    const Vector3f path = lamp - at(hits.position, i), to_lamp = path.normalized();
    const Vector3f normal = at(hits.normal, i), to_eye = at(hits.to_eye, i);
    const float bright = reflectance_(normal.dot(to_lamp), normal.dot(to_eye), to_eye.dot(to_lamp));
    radiance[i] += lamp_ / path.squaredNorm() * hits.albedo[i] * bright;
  }
}

}  // namespace demslam

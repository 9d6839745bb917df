#pragma once

#include <embree4/rtcore.h>

#include <Eigen/Core>
#include <cstdint>

#include "demslam/sim/lit_ground.h"
#include "demslam/sim/photometry.h"
#include "demslam/sim/ray_packet.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// Sets ray i of a packet; it goes from `near` to `far`, in lengths of `direction`.
void set_ray(RTCRay16& rays, int i, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float near,
             float far);

/// How a surface stands to the sun; `turned_away` does not say whether anything is in between.
enum class Sunlight : std::uint8_t { turned_away, shadowed, partly, lit };

/// Casts shadow rays; those that are blocked come back with a negative length.
void cast_shadows(RTCScene scene, const int* valid, RTCRay16& rays);

/// The light of a scene: the sun as a disc, what the sunlit ground gives back, a headlamp, and the Earth as a point. A
/// full Earth of geometric albedo 0.367 gives 0.367 (6371 km / 384400 km)^2 = 1.0e-4 of the sun's irradiance. The
/// ground's light is that of an endless plain, with the view factor (1 - n_z) / 2, and of the relief around, with 0.02,
/// both as bright as LitGround says of the place two metres before the surface: a slope that faces shadowed ground gets
/// little.
class Illumination {
 public:
  explicit Illumination(const LightOptions& light);

  /// To be called when the surroundings have changed.
  void look_around(const Clipmap& clipmap, RTCScene scene) { ground_.build(clipmap, scene, sun_); }
  /// Radiance (I/F) towards the eye of the hits whose `valid` is not zero. `key` differs from packet to packet; the
  /// lamp stands at `lamp` relative to the scene's origin. Also tells how the hits stand to the sun.
  void light(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key, const Eigen::Vector3f& lamp,
             float* radiance, Sunlight* sun) const;
  /// The same for further rays of pixels, four of a pixel side by side, which look at four points of the sun's disc.
  void light_further(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key, const Eigen::Vector3f& lamp,
                     float* radiance) const;
  /// The same without any rays, where the sun is known to be in sight or not: without a lamp and an Earth.
  void light_unbroken(const int* valid, const Hits& hits, bool is_lit, float* radiance) const;
  /// Whether light() is the sun's and the ground's alone.
  bool is_sun_only() const { return earthshine_ <= 0.0F && lamp_ <= 0.0F; }

 private:
  bool turn_to_sun(const int* valid, const Hits& hits, float* mu0, int* facing) const;
  void groundlight(const int* valid, const Hits& hits, float* radiance) const;
  void sunlight(RTCScene scene, const int* valid, const Hits& hits, std::uint64_t key, float* radiance,
                Sunlight* sun) const;
  void other_light(RTCScene scene, const int* valid, const Hits& hits, const Eigen::Vector3f& lamp,
                   float* radiance) const;
  /// Adds the sun's light, of which each hit sees a share.
  void reflect(const Hits& hits, const float* mu0, const float* share, float* radiance) const;
  void lamplight(RTCScene scene, const int* valid, const Hits& hits, const Eigen::Vector3f& lamp,
                 float* radiance) const;
  void earthlight(RTCScene scene, const int* valid, const Hits& hits, float* radiance) const;
  /// Adds 1 to the lanes whose ray to a point of the sun's disc is free; each lane has its point.
  void probe_sun(RTCScene scene, const int* facing, const Hits& hits, const Eigen::Vector2f* points, float* free) const;
  /// Whether something casts a shadow on one of the lanes from so far that its penumbra is wider than half a pixel.
  bool penumbra_shows(RTCScene scene, const int* shadowed, const Hits& hits) const;

  Reflectance reflectance_;
  LitGround ground_;
  Eigen::Vector3f sun_, sun_right_, sun_up_;  ///< direction to the sun, and its disc's radius vectors
  float disc_;                                ///< width of the sun's disc, radians
  float fill_, lamp_;
  Eigen::Vector3f earth_;
  float earthshine_;  ///< irradiance, relative to the sun's
};

}  // namespace demslam

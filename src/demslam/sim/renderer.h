#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "demslam/geometry/camera.h"
#include "demslam/sim/ray_packet.h"
#include "demslam/sim/rocks.h"
#include "demslam/sim/scene.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// What one camera sees, before optics and electronics. Rows from the top, the centre of the top-left pixel is (0, 0).
struct Rendering {
  int width = 0, height = 0;
  std::vector<float> radiance;          ///< I/F, mean over the pixel
  std::vector<float> depth_m;           ///< camera z at the pixel's centre; infinity: sky
  std::vector<Surface> surface;         ///< at the pixel's centre
  std::vector<Eigen::Vector3f> normal;  ///< at the pixel's centre, map frame; 0: sky; empty: not asked for
};

/// How the camera moves while it takes the image. The pose given to render() is that of the middle row's mid-exposure.
struct Shutter {
  Vector6d twist = Vector6d::Zero();  ///< rotation first, per second, camera frame
  double exposure_s = 0.0;            ///< each row is the mean over it
  double readout_s = 0.0;             ///< the last row is taken so much later than the first
};

/// What a ray met first.
struct RangeReturn {
  float range = 0.0F;  ///< in lengths of the ray's direction; infinity: nothing
  Surface surface = Surface::sky;
};

/// Casts rays into terrain and rocks around a place (Embree): a sun, a lamp, black sky. The scene is single precision
/// relative to an origin near the rover. Work is parallel over rays and its result does not depend on the threads.
class Renderer {
 public:
  Renderer(const SceneOptions& scene, const Terrain& terrain, const Route& route);
  ~Renderer();
  Renderer(Renderer&&) noexcept;

  /// Puts one more object into the world, wherever the rover is (tests, landmarks).
  void place(const Rock& rock);
  /// Prepares the surroundings of a map position; needed before render(), and again when the rover has moved.
  void centre_on(const Eigen::Vector2d& position);
  void set_lamp(const Eigen::Vector3d& p_map);

  /// One caller at a time.
  Rendering render(const Camera& camera, const Pose& T_map_camera, const Shutter& shutter = {},
                   bool normals = false) const;
  /// First returns of rays from the sensor's origin.
  std::vector<RangeReturn> cast(const Pose& T_map_sensor, std::span<const Eigen::Vector3d> directions) const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace demslam

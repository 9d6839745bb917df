#pragma once

#include <embree4/rtcore.h>

#include <memory>
#include <vector>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/rocks.h"

namespace demslam {

/// Embree's view of a clipmap (one grid geometry per level, geometry id = level) and of rocks (one instance array). The
/// coarse levels, which seldom change, are a scene of their own inside the whole one. Instance ids tell rocks and far
/// levels apart. Scenes are built by one thread, so that they are the same each time.
class RayScene {
 public:
  static constexpr unsigned kRocks = 1000;  ///< instance id; the instance's primitive id is the index of the rock
  static constexpr unsigned kFar = 1001;    ///< instance id of the coarse levels

  explicit RayScene(const std::vector<RockShape>& shapes);

  /// The clipmap must outlive the next build: its vertices are not copied.
  void build(const Clipmap& clipmap, const std::vector<Rock>& rocks);
  RTCScene handle() const { return scene_.get(); }

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  using Device = std::unique_ptr<RTCDeviceTy, Release>;
  using Scene = std::unique_ptr<RTCSceneTy, Release>;

  Scene new_scene() const;
  void add_level(RTCScene scene, const Clipmap& clipmap, unsigned level) const;
  void add_far();
  void add_rocks(const Clipmap& clipmap, const std::vector<Rock>& rocks);
  Scene shape_scene(const RockShape& shape) const;

  Device device_;
  std::vector<Scene> shapes_;
  Scene far_, scene_;
  std::uint64_t far_revision_ = 0;
};

}  // namespace demslam

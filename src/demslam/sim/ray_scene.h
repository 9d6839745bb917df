#pragma once

#include <embree4/rtcore.h>

#include <memory>
#include <vector>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/rocks.h"

namespace demslam {

/// Embree's view of a clipmap (one grid geometry per level, geometry id = level) and of rocks (one instance array,
/// geometry id kRocks, primitive id = index of the rock). Rebuilt as a whole, by one thread, so that it is the same
/// each time.
class RayScene {
 public:
  static constexpr unsigned kRocks = 1000;

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

  void add_level(const Clipmap& clipmap, unsigned level);
  void add_rocks(const Clipmap& clipmap, const std::vector<Rock>& rocks);
  Scene shape_scene(const RockShape& shape) const;

  Device device_;
  std::vector<Scene> shapes_;
  Scene scene_;
};

}  // namespace demslam

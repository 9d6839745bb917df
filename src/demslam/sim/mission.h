#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "demslam/dataset/sensors.h"
#include "demslam/geometry/camera.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/sim/dataset_writer.h"
#include "demslam/sim/renderer.h"
#include "demslam/sim/route.h"
#include "demslam/sim/scene.h"
#include "demslam/sim/schedule.h"
#include "demslam/sim/terrain.h"
#include "demslam/sim/wheel_tracks.h"

namespace demslam {

/// A scene come to life: its ground, the driven route, the cameras on it. Every frame is a function of the scene and of
/// its index alone, so frames may be asked for in any order, again, and by another process.
class Mission {
 public:
  /// Throws Error: DEM unreadable, route off the DEM or through a hole.
  explicit Mission(const SceneOptions& scene);

  const SceneOptions& scene() const { return scene_; }
  const Terrain& terrain() const { return terrain_; }
  const Trajectory& trajectory() const { return trajectory_; }  ///< T_map_body at every frame
  const StereoRig& rig() const { return rig_; }
  double duration_s() const;
  /// T_map_body at any time, seconds since the first frame.
  Pose at(double time_s) const;

  /// Everything that the scene's [output] asks for. One caller at a time.
  SimulatedFrame frame(std::size_t index);
  /// The LiDAR's scan at a frame, whether [output] asks for it or not. One caller at a time.
  std::vector<LidarPoint> scan(std::size_t index);
  /// Grey value per unit of I/F: the scene's own, or what suits the first frame, or, with a memory, the frames up to
  /// this one.
  double exposure(std::size_t index = 0);

 private:
  const SceneOptions& lit_scene();
  /// Moves the renderer's surroundings and the lamp to a frame.
  void go_to(const StampedPose& stamped);
  /// What a camera of the rig sees from where the renderer is: the ground, the sun and its stray light.
  Rendering look(const StampedPose& stamped, const Camera& camera, const Pose& T_left_camera, bool normals) const;
  Shutter shutter(const StampedPose& stamped, const Pose& T_left_camera) const;
  double metered(std::size_t index);
  Pose T_map_left(const StampedPose& stamped) const { return stamped.pose * rig_.T_body_left; }
  Eigen::Vector2d ahead(const Pose& T_map_body) const;
  std::uint64_t noise_key(TimestampNs t_ns, std::uint64_t stream) const;

  SceneOptions scene_;
  Terrain terrain_;
  Route route_;
  Schedule schedule_;
  Trajectory trajectory_;
  StereoRig rig_;
  std::shared_ptr<WheelTracks> tracks_;  ///< null: none are wanted
  Renderer renderer_;
  std::optional<double> exposure_;  ///< of the first frame
  std::vector<float> metered_;      ///< exposure that suits each frame; 0: not yet known
};

}  // namespace demslam

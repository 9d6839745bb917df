#include "demslam/sim/mission.h"

#include <algorithm>

#include "demslam/base/random.h"
#include "demslam/sim/planner.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"
#include "demslam/sim/sensors.h"

namespace demslam {
namespace {

/// The headlamp hangs low and to the left of the cameras: light from beside the eye gives the ground relief.
Eigen::Vector3d lamp_in_body(const CameraOptions& camera) {
  return {camera.forward_m, 0.5 * camera.baseline_m + 0.6, 0.5 * camera.height_m};
}

}  // namespace

Mission::Mission(const SceneOptions& scene)
    : scene_(scene),
      terrain_(scene.terrain, scene.seed),
      route_(with_planned_route(terrain_, scene.rover)),
      trajectory_(drive(terrain_, scene.rover, route_)),
      rig_(stereo_rig(scene.camera)),
      renderer_(scene, terrain_, route_) {}

double Mission::duration_s() const { return to_seconds(trajectory_.back().t_ns - trajectory_.front().t_ns); }

Pose Mission::at(double time_s) const {
  const double s = std::clamp(time_s * scene_.rover.speed_m_per_s, 0.0, route_.length_m());
  return standing_pose(terrain_, scene_.rover, route_.position(s), route_.heading(s));
}

SimulatedFrame Mission::frame(std::size_t index) {
  const StampedPose& stamped = trajectory_.at(index);
  const double grey_per_radiance = exposure();
  Rendering seen = left(stamped);
  SimulatedFrame frame;
  frame.t_ns = stamped.t_ns;
  frame.left = develop(seen, scene_.camera, grey_per_radiance, noise_key(stamped.t_ns, 0));
  frame.right = develop(right(stamped), scene_.camera, grey_per_radiance, noise_key(stamped.t_ns, 1));
  const OutputOptions& output = scene_.output;
  if (output.labels) frame.labels = label_image(seen, rig_.left, T_map_left(stamped), terrain_);
  if (output.lidar) {
    const Lidar lidar;
    frame.lidar = lidar.scan(renderer_, terrain_, stamped.pose * lidar.T_body_lidar, noise_key(stamped.t_ns, 2));
  }
  if (output.depth) frame.depth_m = std::move(seen.depth_m);
  return frame;
}

double Mission::exposure() {
  if (scene_.camera.exposure > 0.0) return scene_.camera.exposure;
  if (!exposure_) exposure_ = automatic_exposure(left(trajectory_.front()));
  return *exposure_;
}

Rendering Mission::left(const StampedPose& stamped) {
  renderer_.centre_on(ahead(stamped.pose));
  renderer_.set_lamp(stamped.pose * lamp_in_body(scene_.camera));
  return renderer_.render(rig_.left, T_map_left(stamped));
}

Rendering Mission::right(const StampedPose& stamped) const {
  return renderer_.render(rig_.right, T_map_left(stamped) * rig_.T_left_right);
}

/// The finest terrain is wanted where the camera looks, a little ahead of the rover.
Eigen::Vector2d Mission::ahead(const Pose& T_map_body) const {
  return (T_map_body * Eigen::Vector3d(scene_.camera.forward_m + 2.0 * scene_.camera.height_m, 0.0, 0.0)).head<2>();
}

std::uint64_t Mission::noise_key(TimestampNs t_ns, std::uint64_t stream) const {
  return Random::mix(Random::mix(scene_.seed + 0x6e6f6973ULL) ^ (4 * static_cast<std::uint64_t>(t_ns) + stream));
}

}  // namespace demslam

#include "demslam/sim/mission.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"
#include "demslam/sim/fillets.h"
#include "demslam/sim/glare.h"
#include "demslam/sim/planner.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"
#include "demslam/sim/sensors.h"
#include "demslam/sim/sun_position.h"

namespace demslam {
namespace {

/// The headlamp hangs low and to the left of the cameras: light from beside the eye gives the ground relief.
Eigen::Vector3d lamp_in_body(const CameraOptions& camera) {
  return {camera.forward_m, 0.5 * camera.baseline_m + 0.6, 0.5 * camera.height_m};
}

constexpr double kOldest = 4.0;  // memories of the exposure; what is older is forgotten

/// The camera with an eighth of its pixels per axis.
Camera light_meter(Camera camera) {
  camera.width /= 8;
  camera.height /= 8;
  for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value /= 8.0;
  return camera;
}

struct ExposureKeys {
  std::uint64_t noise, camera;
};

/// A rendering becomes an image.
void expose(const SceneOptions& scene, const Rendering& seen, double grey_per_radiance, const ExposureKeys& keys,
            Image& image, std::vector<std::uint16_t>& deep) {
  const Levels levels =
      develop(seen, scene.camera, grey_per_radiance, keys.noise, Random::mix(scene.seed) + keys.camera);
  image = levels.upper_byte();
  if (levels.bits > 8) deep = levels.aligned();
}

}  // namespace

Mission::Mission(const SceneOptions& scene)
    : scene_(scene),
      terrain_(scene.terrain, scene.seed),
      route_(with_known_route(terrain_, scene.rover)),
      schedule_(scene.rover, route_),
      trajectory_(drive(terrain_, scene.rover, route_)),
      rig_(stereo_rig(scene.camera)),
      tracks_(scene.terrain.tracks ? std::make_shared<WheelTracks>(route_, scene.rover.track_m) : nullptr),
      renderer_(lit_scene(), terrain_, route_) {
  terrain_.add_layer(std::make_shared<Fillets>(terrain_.rocks(), route_));
  if (tracks_) terrain_.add_layer(tracks_);
}

const SceneOptions& Mission::lit_scene() {
  scene_.light = light_at_time(scene_.light, terrain_.base().raster().frame);
  return scene_;
}

double Mission::duration_s() const { return to_seconds(trajectory_.back().t_ns - trajectory_.front().t_ns); }

Pose Mission::at(double time_s) const {
  const auto [s, heading] = schedule_.at(time_s);
  return standing_pose(terrain_, scene_.rover, route_.position(s), heading);
}

SimulatedFrame Mission::frame(std::size_t index) {
  const StampedPose& stamped = trajectory_.at(index);
  const double grey_per_radiance = exposure(index);
  go_to(stamped);
  const OutputOptions& output = scene_.output;
  Rendering seen = look(stamped, rig_.left, Pose(), output.normals);
  SimulatedFrame frame;
  frame.t_ns = stamped.t_ns;
  expose(scene_, seen, grey_per_radiance, {noise_key(stamped.t_ns, 0), 0}, frame.left, frame.left_16);
  expose(scene_, look(stamped, rig_.right, rig_.T_left_right, false), grey_per_radiance,
         {noise_key(stamped.t_ns, 1), 1}, frame.right, frame.right_16);
  if (output.labels) frame.labels = label_image(seen, rig_.left, T_map_left(stamped), terrain_);
  if (output.lidar) frame.lidar = lidar_text(scan(index));
  if (output.depth) frame.depth_m = std::move(seen.depth_m);
  frame.normals = std::move(seen.normal);
  return frame;
}

std::vector<LidarPoint> Mission::scan(std::size_t index) {
  static const Lidar lidar;
  const StampedPose& stamped = trajectory_.at(index);
  go_to(stamped);
  return lidar.scan(renderer_, terrain_, stamped.pose * lidar.T_body_lidar, noise_key(stamped.t_ns, 2));
}

double Mission::exposure(std::size_t index) {
  const CameraOptions& camera = scene_.camera;
  if (camera.exposure > 0.0) return camera.exposure;
  if (camera.exposure_memory_s <= 0.0) {
    if (!exposure_) {
      go_to(trajectory_.front());
      exposure_ = automatic_exposure(renderer_.render(rig_.left, T_map_left(trajectory_.front())));
    }
    return *exposure_;
  }
  double sum = 0.0, weights = 0.0;
  for (std::size_t k = index + 1; k-- > 0;) {
    const double age = to_seconds(trajectory_[index].t_ns - trajectory_[k].t_ns) / camera.exposure_memory_s;
    if (age > kOldest) break;
    sum += std::exp(-age) * std::log(metered(k));
    weights += std::exp(-age);
  }
  return std::exp(sum / weights);
}

/// What a light meter of few pixels says at a frame; kept, because the frames that follow ask again.
double Mission::metered(std::size_t index) {
  if (metered_.empty()) metered_.assign(trajectory_.size(), 0.0F);
  if (metered_[index] == 0.0F) {
    go_to(trajectory_[index]);
    metered_[index] = static_cast<float>(
        automatic_exposure(renderer_.render(light_meter(rig_.left), T_map_left(trajectory_[index]))));
  }
  return metered_[index];
}

void Mission::go_to(const StampedPose& stamped) {
  if (tracks_) tracks_->set_driven(schedule_.at(to_seconds(stamped.t_ns - trajectory_.front().t_ns)).s_m);
  renderer_.centre_on(ahead(stamped.pose));
  renderer_.set_lamp(stamped.pose * lamp_in_body(scene_.camera));
}

Rendering Mission::look(const StampedPose& stamped, const Camera& camera, const Pose& T_left_camera,
                        bool normals) const {
  const Pose T_map_camera = T_map_left(stamped) * T_left_camera;
  Rendering seen = renderer_.render(camera, T_map_camera, shutter(stamped, T_left_camera), normals);
  add_sun(seen, camera, scene_.light, find_sun(renderer_, scene_.light, camera, T_map_camera), scene_.camera.flare);
  return seen;
}

/// The camera's motion around a frame, by a central difference.
Shutter Mission::shutter(const StampedPose& stamped, const Pose& T_left_camera) const {
  Shutter shutter{.exposure_s = scene_.camera.exposure_time_s, .readout_s = scene_.camera.readout_time_s};
  if (shutter.exposure_s <= 0.0 && shutter.readout_s <= 0.0) return shutter;
  const double time_s = to_seconds(stamped.t_ns - trajectory_.front().t_ns), half_s = 0.05;
  const Pose step = at(time_s - half_s).inverse() * at(time_s + half_s);
  const Pose T_camera_body = (rig_.T_body_left * T_left_camera).inverse();
  shutter.twist = T_camera_body.adjoint() * step.log() / (2.0 * half_s);
  return shutter;
}

/// The finest terrain is wanted where the camera looks, a little ahead of the rover.
Eigen::Vector2d Mission::ahead(const Pose& T_map_body) const {
  return (T_map_body * Eigen::Vector3d(scene_.camera.forward_m + 2.0 * scene_.camera.height_m, 0.0, 0.0)).head<2>();
}

std::uint64_t Mission::noise_key(TimestampNs t_ns, std::uint64_t stream) const {
  return Random::mix(Random::mix(scene_.seed + 0x6e6f6973ULL) ^ (4 * static_cast<std::uint64_t>(t_ns) + stream));
}

}  // namespace demslam

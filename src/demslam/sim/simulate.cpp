#include "demslam/sim/simulate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "demslam/base/random.h"
#include "demslam/base/time.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/start_pose.h"
#include "demslam/dem/dem.h"
#include "demslam/sim/dataset_writer.h"
#include "demslam/sim/dem_product.h"
#include "demslam/sim/planner.h"
#include "demslam/sim/renderer.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"
#include "demslam/sim/sensors.h"

namespace demslam {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// The headlamp hangs low and to the left of the cameras: light from beside the eye gives the ground relief.
Eigen::Vector3d lamp_in_body(const CameraOptions& camera) {
  return {camera.forward_m, 0.5 * camera.baseline_m + 0.6, 0.5 * camera.height_m};
}

/// Everything a mission needs besides its output.
struct Mission {
  explicit Mission(const SceneOptions& options)
      : scene(options),
        terrain(options.terrain, options.seed),
        route(with_planned_route(terrain, options.rover)),
        trajectory(drive(terrain, options.rover, route)),
        rig(stereo_rig(options.camera)),
        renderer(options, terrain, route) {}

  Pose T_map_left(const StampedPose& stamped) const { return stamped.pose * rig.T_body_left; }
  Rendering left(const StampedPose& stamped) {
    renderer.centre_on(ahead(stamped.pose));
    renderer.set_lamp(stamped.pose * lamp_in_body(scene.camera));
    return renderer.render(rig.left, T_map_left(stamped));
  }
  Rendering right(const StampedPose& stamped) const {
    return renderer.render(rig.right, T_map_left(stamped) * rig.T_left_right);
  }
  Pose at(double time_s) const {
    const double s = std::clamp(time_s * scene.rover.speed_m_per_s, 0.0, route.length_m());
    return standing_pose(terrain, scene.rover, route.position(s), route.heading(s));
  }
  double duration_s() const { return to_seconds(trajectory.back().t_ns - trajectory.front().t_ns); }
  /// The finest terrain is wanted where the camera looks, a little ahead of the rover.
  Eigen::Vector2d ahead(const Pose& T_map_body) const {
    return (T_map_body * Eigen::Vector3d(scene.camera.forward_m + 2.0 * scene.camera.height_m, 0.0, 0.0)).head<2>();
  }

  SceneOptions scene;
  Terrain terrain;
  Route route;
  Trajectory trajectory;
  StereoRig rig;
  Renderer renderer;
};

StartPose believed_start(const StartOptions& start, const Pose& T_map_body) {
  StartPose believed;
  believed.T_map_body = Pose(rotation_from_rpy(0.0, 0.0, start.heading_error_deg * kRadPerDeg) * T_map_body.rotation(),
                             T_map_body.translation() + start.error_m);
  believed.sigma_position_m = start.sigma_position_m;
  believed.sigma_rotation_rad = start.sigma_rotation_deg * kRadPerDeg;
  return believed;
}

void write_motion_sensors(const Mission& mission, const DatasetWriter& writer) {
  const SceneOptions& scene = mission.scene;
  const Motion motion = [&](double time_s) { return mission.at(time_s); };
  const TimestampNs first = mission.trajectory.front().t_ns;
  const double duration = mission.duration_s();
  if (scene.output.imu) writer.write_text("imu.txt", imu_text(motion, first, duration, scene.seed));
  if (scene.output.wheels) {
    writer.write_text("wheels.txt", wheels_text(motion, first, duration, scene.rover.track_m, scene.seed));
  }
  if (!scene.output.lidar) return;
  Trajectory scanner = mission.trajectory;
  for (StampedPose& stamped : scanner) stamped.pose = stamped.pose * Lidar().T_body_lidar;
  writer.write_text("LiDAR/timestamp.txt", stamped_pose_text(scanner));
}

void write_mission_files(const Mission& mission, const DatasetWriter& writer) {
  const SceneOptions& scene = mission.scene;
  writer.write_text("calibration.toml", calibration_toml(miscalibrated(mission.rig, scene.calibration_error)));
  writer.write_text("start.toml", start_pose_toml(believed_start(scene.start, mission.trajectory.front().pose)));
  writer.write_text("gt.txt",
                    ground_truth_text(mission.trajectory, scene.output.imu ? imu_bias(scene.seed) : ImuBias{}));
  write_motion_sensors(mission, writer);
  const DemRaster truth = averaged_ground(mission.terrain, mission.trajectory, scene.dem_product);
  writer.write_raster("truth/dem_truth.tif", truth);
  writer.write_raster("dem.tif", degraded(truth, scene.dem_product, scene.seed));
}

double exposure_of(Mission& mission) {
  const double fixed = mission.scene.camera.exposure;
  return fixed > 0.0 ? fixed : automatic_exposure(mission.left(mission.trajectory.front()));
}

std::uint64_t noise_key(const SceneOptions& scene, TimestampNs t_ns, std::uint64_t stream) {
  return Random::mix(Random::mix(scene.seed + 0x6e6f6973ULL) ^ (4 * static_cast<std::uint64_t>(t_ns) + stream));
}

SimulatedFrame make_frame(Mission& mission, const StampedPose& stamped, double exposure) {
  const CameraOptions& camera = mission.scene.camera;
  Rendering left = mission.left(stamped);
  const Rendering right = mission.right(stamped);
  SimulatedFrame frame;
  frame.t_ns = stamped.t_ns;
  frame.left = develop(left, camera, exposure, noise_key(mission.scene, stamped.t_ns, 0));
  frame.right = develop(right, camera, exposure, noise_key(mission.scene, stamped.t_ns, 1));
  const OutputOptions& output = mission.scene.output;
  if (output.labels) frame.labels = label_image(left, mission.rig.left, mission.T_map_left(stamped), mission.terrain);
  if (output.lidar) {
    const Lidar lidar;
    frame.lidar = lidar.scan(mission.renderer, mission.terrain, stamped.pose * lidar.T_body_lidar,
                             noise_key(mission.scene, stamped.t_ns, 2));
  }
  if (output.depth) frame.depth_m = std::move(left.depth_m);
  return frame;
}

}  // namespace

SimulationReport simulate(const SceneOptions& scene, const std::filesystem::path& out, const Progress& progress) {
  const Stopwatch watch;
  check_scene(scene, "scene");
  Mission mission(scene);
  const DatasetWriter writer(out, scene);
  write_mission_files(mission, writer);
  SimulationReport report;
  report.frames = mission.trajectory.size();
  report.length_m = path_length_m(mission.trajectory);
  report.exposure = exposure_of(mission);
  double render_ms = 0.0;
  for (std::size_t i = 0; i < report.frames && !report.stopped; ++i) {
    const StampedPose& stamped = mission.trajectory[i];
    if (!writer.has(stamped.t_ns)) {
      const Stopwatch frame_watch;
      writer.write(make_frame(mission, stamped, report.exposure));
      render_ms += frame_watch.elapsed_ms();
      ++report.rendered;
    }
    progress.report(i + 1, report.frames);
    report.stopped = progress.stop_requested() && i + 1 < report.frames;
  }
  if (!report.stopped) writer.close();
  report.render_ms_per_frame = report.rendered > 0 ? render_ms / static_cast<double>(report.rendered) : 0.0;
  report.elapsed_s = 1e-3 * watch.elapsed_ms();
  return report;
}

}  // namespace demslam

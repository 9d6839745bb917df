#include "demslam/sim/simulate.h"

#include "demslam/base/time.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/start_pose.h"
#include "demslam/dem/dem.h"
#include "demslam/geometry/angle.h"
#include "demslam/sim/dataset_writer.h"
#include "demslam/sim/dem_product.h"
#include "demslam/sim/mission.h"
#include "demslam/sim/pictures.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensors.h"
#include "demslam/sim/sun_position.h"

namespace demslam {
namespace {

constexpr double kSunSensorDeg = 0.5;

StartPose believed_start(const StartOptions& start, const Pose& T_map_body) {
  StartPose believed;
  believed.T_map_body = Pose(rotation_from_rpy(0.0, 0.0, start.heading_error_deg * kRadPerDeg) * T_map_body.rotation(),
                             T_map_body.translation() + start.error_m);
  believed.sigma_position_m = start.sigma_position_m;
  believed.sigma_rotation_rad = start.sigma_rotation_deg * kRadPerDeg;
  return believed;
}

void write_motion_sensors(const Mission& mission, const DatasetWriter& writer) {
  const SceneOptions& scene = mission.scene();
  const PoseAtTime motion = [&](double time_s) { return mission.at(time_s); };
  const TimestampNs first = mission.trajectory().front().t_ns;
  const double duration = mission.duration_s();
  if (scene.output.imu) writer.write_text("imu.txt", imu_text(motion, first, duration, scene.seed));
  if (scene.output.wheels) {
    writer.write_text("wheels.txt", wheels_text(motion, first, duration, scene.rover, scene.seed));
  }
  if (scene.output.sun) {
    const Eigen::Vector3d sun = sky_direction(scene.light.sun_elevation_deg, scene.light.sun_azimuth_deg);
    writer.write_text("sun.csv", sun_text(mission.trajectory(), sun, kSunSensorDeg, scene.seed));
  }
  if (!scene.output.lidar || !scene.output.images) return;
  Trajectory scanner = mission.trajectory();
  for (StampedPose& stamped : scanner) stamped.pose = stamped.pose * Lidar().T_body_lidar;
  writer.write_text("LiDAR/timestamp.txt", stamped_pose_text(scanner));
}

void write_mission_files(const Mission& mission, const DatasetWriter& writer) {
  const SceneOptions& scene = mission.scene();
  writer.write_text("calibration.toml", calibration_toml(miscalibrated(mission.rig(), scene.calibration_error)));
  writer.write_text("start.toml", start_pose_toml(believed_start(scene.start, mission.trajectory().front().pose)));
  writer.write_text("gt.txt",
                    ground_truth_text(mission.trajectory(), scene.output.imu ? imu_bias(scene.seed) : ImuBias{}));
  write_motion_sensors(mission, writer);
  const DemRaster truth = averaged_ground(mission.terrain(), mission.trajectory(), scene.dem_product);
  writer.write_raster("truth/dem_truth.tif", truth);
  writer.write_raster("dem.tif", degraded(truth, scene.dem_product, scene.seed));
}

void write_frames(Mission& mission, const DatasetWriter& writer, const Progress& progress, SimulationReport& report) {
  report.exposure = mission.exposure();
  double render_ms = 0.0;
  for (std::size_t i = 0; i < report.frames && !report.stopped; ++i) {
    if (!writer.has(mission.trajectory()[i].t_ns)) {
      const Stopwatch frame_watch;
      writer.write(mission.frame(i));
      render_ms += frame_watch.elapsed_ms();
      ++report.rendered;
    }
    progress.report(i + 1, report.frames);
    report.stopped = progress.stop_requested() && i + 1 < report.frames;
  }
  report.render_ms_per_frame = report.rendered > 0 ? render_ms / static_cast<double>(report.rendered) : 0.0;
}

}  // namespace

SimulationReport simulate(const SceneOptions& scene, const std::filesystem::path& out, const Progress& progress,
                          const PictureFiles& pictures) {
  const Stopwatch watch;
  check_scene(scene, "scene");
  Mission mission(scene);
  const DatasetWriter writer(out, scene);
  write_mission_files(mission, writer);
  SimulationReport report;
  report.frames = mission.trajectory().size();
  report.length_m = path_length_m(mission.trajectory());
  if (scene.output.images) write_frames(mission, writer, progress, report);
  if (!report.stopped) {
    writer.close();
    MissionPictures look(mission, out);
    if (!pictures.contact_sheet.empty()) look.write_contact_sheet(pictures.contact_sheet);
    if (!pictures.video.empty()) look.write_video(pictures.video);
  }
  report.elapsed_s = 1e-3 * watch.elapsed_ms();
  return report;
}

}  // namespace demslam

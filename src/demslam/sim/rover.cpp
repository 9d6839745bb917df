#include "demslam/sim/rover.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/sim/schedule.h"

namespace demslam {
namespace {

constexpr TimestampNs kFirstStamp = 1'000'000'000;
constexpr double kContactStep = 0.06;  // contact patch of a wheel: 3 x 3 nodes at this spacing

double contact_height(const Terrain& terrain, const Eigen::Vector2d& wheel) {
  Patch contact(wheel.x() - kContactStep, wheel.y() - kContactStep, kContactStep, 3, 3);
  terrain.fill_ground(contact);
  double sum = 0.0;
  for (const double height : contact.values) sum += height;
  return sum / static_cast<double>(contact.values.size());
}

std::string place(const Eigen::Vector2d& position, double s_m) {
  char text[96];
  std::snprintf(text, sizeof text, "map x = %.1f m, y = %.1f m, after %.1f m of the route", position.x(), position.y(),
                s_m);
  return text;
}

void check_ground(const BaseSurface& base, const Eigen::Vector2d& position, double s_m) {
  if (!base.inside(position.x(), position.y())) {
    throw Error("the route leaves the terrain at " + place(position, s_m) +
                "; shorten or move it, or use a larger DEM");
  }
  if (base.is_hole(position.x(), position.y())) {
    throw Error("the route crosses a hole (no data) of the DEM at " + place(position, s_m) + "; move the route");
  }
}

}  // namespace

Pose standing_pose(const Terrain& terrain, const RoverOptions& rover, const Eigen::Vector2d& position, double heading) {
  const Eigen::Vector2d forward(std::cos(heading), std::sin(heading)), left(-forward.y(), forward.x());
  double height = 0.0, along_sum = 0.0, along_squares = 0.0, aside_sum = 0.0, aside_squares = 0.0;
  for (const double along : {0.5 * rover.wheelbase_m, 0.0, -0.5 * rover.wheelbase_m}) {
    if (along == 0.0 && rover.wheels < 6) continue;
    for (const double aside : {0.5 * rover.track_m, -0.5 * rover.track_m}) {
      const double contact = contact_height(terrain, position + along * forward + aside * left);
      height += contact / rover.wheels;
      along_sum += along * contact, along_squares += along * along;
      aside_sum += aside * contact, aside_squares += aside * aside;
    }
  }
  Eigen::Matrix3d R_map_body;
  const Eigen::Vector3d x = Eigen::Vector3d(forward.x(), forward.y(), along_sum / along_squares).normalized();
  const Eigen::Vector3d z = x.cross(Eigen::Vector3d(left.x(), left.y(), aside_sum / aside_squares)).normalized();
  R_map_body << x, z.cross(x), z;
  return Pose(R_map_body, Eigen::Vector3d(position.x(), position.y(), height));
}

Trajectory drive(const Terrain& terrain, const RoverOptions& rover, const Route& route) {
  const Schedule schedule(rover, route);
  const auto frames = static_cast<std::size_t>(std::floor(schedule.duration_s() * rover.frame_rate_hz + 1e-9)) + 1;
  Trajectory trajectory;
  for (std::size_t i = 0; i < frames; ++i) {
    const double time_s = static_cast<double>(i) / rover.frame_rate_hz;
    const auto [s, heading] = schedule.at(time_s);
    check_ground(terrain.base(), route.position(s), s);
    const auto t_ns = kFirstStamp + static_cast<TimestampNs>(std::llround(1e9 * time_s));
    trajectory.push_back({t_ns, standing_pose(terrain, rover, route.position(s), heading)});
  }
  return trajectory;
}

StereoRig stereo_rig(const CameraOptions& options) {
  Camera camera;
  camera.width = options.width_px;
  camera.height = options.height_px;
  camera.fx = camera.fy = 0.5 * options.width_px / std::tan(options.horizontal_fov_deg * std::numbers::pi / 360.0);
  camera.cx = 0.5 * (options.width_px - 1);
  camera.cy = 0.5 * (options.height_px - 1);
  if (options.lens == Lens::fisheye) {
    camera.distortion = Distortion::equidistant;
    camera.fx = camera.fy = 0.5 * options.width_px / (options.horizontal_fov_deg * std::numbers::pi / 360.0);
  }
  if (!options.distortion.empty()) {
    if (options.lens == Lens::pinhole) camera.distortion = Distortion::radtan;
    std::copy(options.distortion.begin(), options.distortion.end(), camera.coefficients.begin());
  }
  StereoRig rig;
  rig.left = rig.right = camera;
  rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(options.baseline_m, 0.0, 0.0));
  const double pitch = options.pitch_down_deg * std::numbers::pi / 180.0;
  rig.T_body_left = Pose(rotation_from_rpy(0.0, pitch, 0.0) * R_body_camera_level(),
                         Eigen::Vector3d(options.forward_m, 0.5 * options.baseline_m, options.height_m));
  return rig;
}

StereoRig miscalibrated(StereoRig rig, const CalibrationErrorOptions& error) {
  const Eigen::Vector3d turn = error.rotation_deg * std::numbers::pi / 180.0;
  const Eigen::Quaterniond rotation = rotation_from_rpy(turn.x(), turn.y(), turn.z());
  rig.T_left_right = Pose(rotation * rig.T_left_right.rotation(),
                          rig.T_left_right.translation() + Eigen::Vector3d(error.baseline_m, 0.0, 0.0));
  for (Camera* camera : {&rig.left, &rig.right}) {
    camera->fx += error.focal_px;
    camera->fy += error.focal_px;
  }
  rig.right.cy += error.row_offset_px;
  return rig;
}

}  // namespace demslam

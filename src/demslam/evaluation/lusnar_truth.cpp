#include "demslam/evaluation/lusnar_truth.h"

namespace demslam {
namespace {

/// Half a turn about x: forward, right, down becomes forward, left, up, and back.
Pose half_turn() { return Pose(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d::Zero()); }

}  // namespace

bool is_lusnar_truth(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  const fs::path folder = file.parent_path();
  const bool named = file.filename() == "gt.txt" || file.filename() == "Rover_pose.txt";
  return named && !fs::exists(folder / "calibration.toml") && fs::is_directory(folder / "image1");
}

WorldZ lusnar_world_z(const Trajectory& T_world_rover) {
  double down = 0.0;
  for (const StampedPose& stamped : T_world_rover) down += (stamped.pose.rotation() * Eigen::Vector3d::UnitZ()).z();
  return down > 0.0 ? WorldZ::down : WorldZ::up;
}

Trajectory lusnar_T_map_body(const Trajectory& T_world_rover) {
  const Pose T_map_world = lusnar_world_z(T_world_rover) == WorldZ::down ? half_turn() : Pose();
  Trajectory poses;
  for (const StampedPose& stamped : T_world_rover) {
    poses.push_back({stamped.t_ns, T_map_world * stamped.pose * half_turn()});
  }
  return poses;
}

}  // namespace demslam

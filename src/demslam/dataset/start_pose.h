#pragma once

#include <filesystem>
#include <string>

#include "demslam/geometry/pose.h"

namespace demslam {

/// What the mission knows of the first pose, and how well (one standard deviation per axis).
struct StartPose {
  Pose T_map_body;
  double sigma_position_m = 0.1;
  double sigma_rotation_rad = 0.01;
};

/// start.toml:  T_map_body = [16 numbers, row-major], sigma_position_m = 0.1, sigma_rotation_deg = 0.5
/// Throws Error with file and line.
StartPose read_start_pose(const std::filesystem::path& file);
std::string start_pose_toml(const StartPose& start);

}  // namespace demslam

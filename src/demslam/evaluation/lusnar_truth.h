#pragma once

#include <filesystem>

#include "demslam/geometry/trajectory.h"

namespace demslam {

/// Is this the gt.txt or Rover_pose.txt of a LuSNAR scene as downloaded? (A calibration.toml beside it makes the folder
/// demslam's own layout, whose gt.txt holds T_map_body.)
bool is_lusnar_truth(const std::filesystem::path& file);

enum class WorldZ { up, down };

/// Which way LuSNAR's world z points: the rover frame is forward, right, down, and a rover stands upright.
WorldZ lusnar_world_z(const Trajectory& T_world_rover);

/// LuSNAR's poses in our axes: body forward, left, up in a map whose z points up (where the world's z points down, map
/// x is the world's x and map y the world's -y).
Trajectory lusnar_T_map_body(const Trajectory& T_world_rover);

}  // namespace demslam

#include "demslam/dataset/start_pose.h"

#include <numbers>

#include "demslam/toml/toml.h"

namespace demslam {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

template <class Io>
void fields(Io& io, Pose& T_map_body, double& sigma_position_m, double& sigma_rotation_deg) {
  io.field("T_map_body", T_map_body);
  io.field("sigma_position_m", sigma_position_m);
  io.field("sigma_rotation_deg", sigma_rotation_deg);
}

}  // namespace

StartPose read_start_pose(const std::filesystem::path& file) {
  TomlReader toml = TomlReader::from_file(file);
  StartPose start;
  double sigma_rotation_deg = start.sigma_rotation_rad * kDegreesPerRadian;
  toml.require("T_map_body");
  fields(toml, start.T_map_body, start.sigma_position_m, sigma_rotation_deg);
  toml.reject_unknown();
  if (start.sigma_position_m <= 0.0) toml.fail("sigma_position_m", "'sigma_position_m' must be positive");
  if (sigma_rotation_deg <= 0.0) toml.fail("sigma_rotation_deg", "'sigma_rotation_deg' must be positive");
  start.sigma_rotation_rad = sigma_rotation_deg / kDegreesPerRadian;
  return start;
}

std::string start_pose_toml(const StartPose& start) {
  TomlWriter toml;
  StartPose copy = start;
  double sigma_rotation_deg = start.sigma_rotation_rad * kDegreesPerRadian;
  fields(toml, copy.T_map_body, copy.sigma_position_m, sigma_rotation_deg);
  return toml.text();
}

}  // namespace demslam

#include "demslam/dataset/calibration.h"

#include <algorithm>
#include <vector>

#include "demslam/base/error.h"
#include "demslam/dataset/calibration_import.h"
#include "demslam/toml/toml.h"

namespace demslam {
namespace {

const std::vector<std::pair<std::string, Distortion>> kDistortionNames = {
    {"none", Distortion::none}, {"radtan", Distortion::radtan}, {"equidistant", Distortion::equidistant}};

std::size_t coefficient_limit(Distortion distortion) {
  return distortion == Distortion::none ? 0 : distortion == Distortion::radtan ? 5 : 4;
}

std::string name_of(Distortion distortion) {
  return std::find_if(kDistortionNames.begin(), kDistortionNames.end(),
                      [&](const auto& entry) { return entry.second == distortion; })
      ->first;
}

template <class Io>
void pinhole_fields(Io& io, Camera& camera) {
  io.field("width", camera.width);
  io.field("height", camera.height);
  io.field("fx", camera.fx);
  io.field("fy", camera.fy);
  io.field("cx", camera.cx);
  io.field("cy", camera.cy);
}

void read_distortion(TomlReader& toml, Camera& camera) {
  std::string name = name_of(camera.distortion);
  toml.field("distortion", name);
  const auto found = std::find_if(kDistortionNames.begin(), kDistortionNames.end(),
                                  [&](const auto& entry) { return entry.first == name; });
  if (found == kDistortionNames.end()) {
    toml.fail("distortion", "unknown distortion '" + name + "'; known are none, radtan and equidistant");
  }
  camera.distortion = found->second;
  std::vector<double> coefficients;
  toml.field("coefficients", coefficients);
  const std::size_t limit = coefficient_limit(camera.distortion);
  if (coefficients.size() > limit) {
    toml.fail("coefficients", "distortion '" + name + "' takes at most " + std::to_string(limit) + " coefficients");
  }
  std::copy(coefficients.begin(), coefficients.end(), camera.coefficients.begin());
}

Camera read_camera(TomlReader& toml) {
  Camera camera;
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy"}) toml.require(key);
  pinhole_fields(toml, camera);
  read_distortion(toml, camera);
  return camera;
}

void write_camera(TomlWriter& toml, Camera camera) {
  pinhole_fields(toml, camera);
  toml.field("distortion", name_of(camera.distortion));
  const std::size_t count = coefficient_limit(camera.distortion);
  toml.field("coefficients", std::vector<double>(camera.coefficients.begin(), camera.coefficients.begin() + count));
}

void read_stereo(TomlReader& toml, StereoRig& rig) {
  if (toml.has("baseline_m") == toml.has("T_left_right")) {
    toml.fail("T_left_right", "give either 'baseline_m' or 'T_left_right'");
  }
  double baseline_m = 0.0, row_offset_px = 0.0;
  toml.field("baseline_m", baseline_m);
  rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), {baseline_m, 0.0, 0.0});
  toml.field("T_left_right", rig.T_left_right);
  toml.field("row_offset_px", row_offset_px);
  rig.right.cy += row_offset_px;
}

void read_body(TomlReader& toml, StereoRig& rig) {
  toml.field("T_body_left", rig.T_body_left);
  toml.field("p_body_ground_m", rig.p_body_ground);
}

std::optional<double> read_frame_rate(TomlReader& toml) {
  if (!toml.has("frame_rate_hz")) return std::nullopt;
  double frame_rate_hz = 0.0;
  toml.field("frame_rate_hz", frame_rate_hz);
  if (frame_rate_hz <= 0.0) toml.fail("frame_rate_hz", "'frame_rate_hz' must be positive");
  return frame_rate_hz;
}

}  // namespace

Pose level_T_body_left() { return Pose(R_body_camera_level(), Eigen::Vector3d::Zero()); }

Calibration read_calibration(const std::filesystem::path& file) {
  if (file.extension() == ".yaml" || file.extension() == ".yml") return import_calibration(file);
  TomlReader toml = TomlReader::from_file(file);
  Calibration calibration;
  StereoRig& rig = calibration.rig;
  toml.require("left");
  toml.section("left", [&](TomlReader& left) { rig.left = read_camera(left); });
  rig.right = rig.left;
  toml.section("right", [&](TomlReader& right) { rig.right = read_camera(right); });
  read_stereo(toml, rig);
  rig.T_body_left = level_T_body_left();
  toml.section("body", [&](TomlReader& body) { read_body(body, rig); });
  calibration.frame_rate_hz = read_frame_rate(toml);
  toml.reject_unknown();
  check_rig(rig, file.string());
  return calibration;
}

StereoRig read_calibration_toml(const std::filesystem::path& file) { return read_calibration(file).rig; }

std::string calibration_toml(const StereoRig& rig) {
  TomlWriter toml;
  toml.field("T_left_right", rig.T_left_right);
  toml.section("left", [&](TomlWriter& left) { write_camera(left, rig.left); });
  toml.section("right", [&](TomlWriter& right) { write_camera(right, rig.right); });
  toml.section("body", [&](TomlWriter& body) {
    body.field("T_body_left", rig.T_body_left);
    body.field("p_body_ground_m", rig.p_body_ground);
  });
  return toml.text();
}

}  // namespace demslam

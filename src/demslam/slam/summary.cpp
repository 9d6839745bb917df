#include "demslam/slam/summary.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/base/version.h"
#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

double first_to_last_m(const Trajectory& trajectory) {
  if (trajectory.empty()) return 0.0;
  return (trajectory.back().pose.translation() - trajectory.front().pose.translation()).norm();
}

Json file_json(const fs::path& file) {
  return {{"path", fs::absolute(file).lexically_normal().string()}, {"sha256", sha256_of_file(file)}};
}

Json counters_json(const SlamCounters& counters) {
  return {{"frames", counters.frames},
          {"tracked", counters.tracked},
          {"bridged", counters.bridged},
          {"keyframes", counters.keyframes},
          {"loops",
           {{"proposed", counters.loops.proposed},
            {"verified", counters.loops.verified},
            {"accepted", counters.loops.accepted},
            {"rejected", counters.loops.rejected},
            {"rejected_later", counters.loops.rejected_later}}},
          {"relocalised", counters.relocalised},
          {"in_earlier_map", counters.in_earlier_map},
          {"dem_factors",
           {{"height", counters.anchoring.height},
            {"normal", counters.anchoring.normal},
            {"skipped_outside", counters.anchoring.skipped_outside},
            {"skipped_tilt", counters.anchoring.skipped_tilt},
            {"patches", counters.anchoring.patches},
            {"patch_cells", counters.anchoring.patch_cells},
            {"skipped_patches", counters.anchoring.skipped_patches},
            {"noise_scale", counters.anchoring.noise_scale},
            {"submaps_searched", counters.anchoring.submaps.searched},
            {"submaps_accepted", counters.anchoring.submaps.accepted},
            {"submaps_moved", counters.anchoring.submaps.moved}}},
          {"suns", counters.suns},
          {"start_search", counters.anchoring.start_search}};
}

/// Null where no DEM was used, or its place was taken for granted.
Json shift_json(const std::optional<DemShift>& shift) {
  if (!shift) return nullptr;
  const Eigen::Vector3d sigma = shift->sigma_m();
  return {{"m", {shift->metres.x(), shift->metres.y(), shift->metres.z()}},
          {"sigma_m", {sigma.x(), sigma.y(), sigma.z()}}};
}

/// Null where it was not looked for.
Json vergence_json(const std::optional<Vergence>& vergence) {
  if (!vergence) return nullptr;
  return {{"deg", vergence->rad / kRadPerDeg}, {"sigma_deg", vergence->sigma_rad() / kRadPerDeg}};
}

/// Paths taken out: a dataset may have been moved.
Json without_paths(Json json) {
  if (json.is_object()) {
    json.erase("path");
    json.erase("dataset");
  }
  if (!json.is_structured()) return json;
  for (Json& part : json) part = without_paths(part);
  return json;
}

std::string first_difference(const std::string& earlier_inputs, const std::string& inputs) {
  const Json earlier = without_paths(Json::parse(earlier_inputs)), now = without_paths(Json::parse(inputs));
  const Json difference = Json::diff(earlier, now);
  if (difference.empty()) return {};
  std::string path = difference[0]["path"].get<std::string>().substr(1);
  return path.substr(0, path.find('/'));
}

/// "section.key" of the first line that differs.
std::string first_changed_option(const std::string& earlier_config, const std::string& config) {
  std::istringstream earlier(earlier_config), now(config);
  std::string section;
  for (std::string a, b; std::getline(now, b);) {
    if (!std::getline(earlier, a)) a.clear();
    if (b.starts_with('[')) section = fmt::format("{}.", b.substr(1, b.find(']') - 1));
    if (a != b) return fmt::format("{}{} ('{}' then, '{}' now)", section, b.substr(0, b.find(' ')), a, b);
  }
  return {};
}

}  // namespace

fs::path map_file(const fs::path& map_or_run) {
  return fs::is_directory(map_or_run) ? map_or_run / "map.db" : map_or_run;
}

SensorFiles sensor_files(const RunInputs& inputs, const StereoSequence& sequence, const SlamOptions& options) {
  SensorFiles files;
  if (sequence.format() != "demslam") return files;  // elsewhere the sensors' frames are not the body's
  const fs::path imu = inputs.dataset / "imu.txt", wheels = inputs.dataset / "wheels.txt",
                 sun = inputs.dataset / "sun.csv";
  if (options.odometry.lost.use_imu && fs::exists(imu)) files.imu = imu;
  if (options.odometry.lost.use_wheels && fs::exists(wheels)) files.wheels = wheels;
  if (options.use_sun && fs::exists(sun)) files.sun = sun;
  return files;
}

std::optional<fs::path> sigma_file(const RunInputs& inputs, const std::optional<fs::path>& dem) {
  if (!dem || inputs.dem_sigma) return dem ? inputs.dem_sigma : std::nullopt;
  return sigma_beside(*dem);
}

std::string inputs_text(const RunInputs& inputs, const StereoSequence& sequence, const std::optional<fs::path>& dem,
                        const SlamOptions& options, const std::string& inference) {
  Json json = {{"dataset", fs::absolute(inputs.dataset).lexically_normal().string()}, {"format", sequence.format()}};
  for (const fs::path& file : sequence.definition_files()) json["files"].push_back(file_json(file));
  if (inputs.start) json["start"] = file_json(*inputs.start);
  if (dem) json["dem"] = file_json(*dem);
  if (const auto sigma = sigma_file(inputs, dem)) json["dem_sigma"] = file_json(*sigma);
  if (inputs.unknown_start_radius_m > 0.0) json["unknown_start_radius_m"] = inputs.unknown_start_radius_m;
  if (inputs.heading_deg) json["heading_deg"] = *inputs.heading_deg;
  const SensorFiles sensors = sensor_files(inputs, sequence, options);
  for (const auto& file : {sensors.imu, sensors.wheels, sensors.sun}) {
    if (file) json["files"].push_back(file_json(*file));
  }
  if (inputs.map) json["map"] = file_json(map_file(*inputs.map));
  json["models"] = Json::array();
  for (const fs::path& model : {options.frontend.extractor_model, options.frontend.matcher_model}) {
    if (!model.empty()) json["models"].push_back(file_json(model));
  }
  if (!inference.empty() && inference != "onnxruntime") json["inference"] = inference;
  json["first_frame"] = inputs.first_frame;
  return json.dump();
}

std::string with_dem(const std::string& inputs_text, const std::optional<fs::path>& dem,
                     const std::optional<fs::path>& dem_sigma) {
  Json inputs = Json::parse(inputs_text);
  inputs.erase("dem");
  inputs.erase("dem_sigma");
  if (dem) inputs["dem"] = file_json(*dem);
  if (dem_sigma) inputs["dem_sigma"] = file_json(*dem_sigma);
  return inputs.dump();
}

std::string summary_text(const RunInputs& inputs, const std::string& inputs_text, const RunReport& report) {
  Json what = Json::parse(inputs_text);
  const Json models = what["models"];
  what.erase("models");
  what.erase("first_frame");
  const Trajectory& trajectory = report.result.trajectory;
  const Json json = {{"demslam", kVersion},
                     {"inputs", what},
                     {"models", models},
                     {"first_frame", inputs.first_frame},
                     {"frames_in_dataset", report.frames_in_dataset},
                     {"frames_asked", report.frames_asked},
                     {"interrupted", report.interrupted},
                     {"anchored", report.anchored},
                     {"counters", counters_json(report.result.counters)},
                     {"dem_shift", shift_json(report.result.dem_shift)},
                     {"vergence", vergence_json(report.vergence)},
                     {"path_length_m", path_length_m(trajectory)},
                     {"first_to_last_m", first_to_last_m(trajectory)}};
  return json.dump(1) + "\n";
}

bool is_finished(const std::string& summary, std::size_t end) {
  const Json json = Json::parse(summary, nullptr, false);
  if (!json.is_object() || json.value("interrupted", false)) return false;
  return json.value("first_frame", std::size_t(0)) + json.value("frames_asked", end) >= end;
}

void check_same_run(const fs::path& run, const std::string& earlier_inputs, const std::string& inputs,
                    const std::string& earlier_config, const std::string& config) {
  const auto refuse = [&](const std::string& what) {
    throw Error(run.string() + ": holds a run that was begun with another " + what +
                "; repeat its command to go on, pass --overwrite to start anew, or choose another folder");
  };
  if (const std::string part = first_difference(earlier_inputs, inputs); !part.empty()) refuse("input: " + part);
  if (const std::string part = first_changed_option(earlier_config, config); !part.empty()) refuse("option: " + part);
}

}  // namespace demslam

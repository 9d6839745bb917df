#include "demslam/slam/replay.h"

#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/dataset/start_pose.h"
#include "demslam/dataset/sun_sensor.h"
#include "demslam/slam/frame_json.h"
#include "demslam/slam/recorder.h"
#include "demslam/slam/run_folder.h"
#include "demslam/slam/summary.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

fs::path recorded_dataset(const Json& inputs) { return inputs.at("dataset").get<std::string>(); }

/// Asked for, else the recorded run's, else the dataset's own.
std::optional<fs::path> chosen_dem(const ReplayInputs& inputs, const Json& recorded, const SlamOptions& options) {
  if (!options.use_dem) return std::nullopt;
  if (inputs.dem) return inputs.dem;
  if (recorded.contains("dem")) return recorded["dem"].at("path").get<std::string>();
  const fs::path own = recorded_dataset(recorded) / "dem.tif";
  return fs::is_regular_file(own) ? std::optional(own) : std::nullopt;
}

/// Of the recorded run's DEM the recorded one, of another DEM the one beside it.
std::optional<fs::path> chosen_sigma(const ReplayInputs& inputs, const Json& recorded,
                                     const std::optional<fs::path>& dem) {
  if (dem && !inputs.dem && recorded.contains("dem")) {
    return recorded.contains("dem_sigma") ? std::optional<fs::path>(recorded["dem_sigma"].at("path").get<std::string>())
                                          : std::nullopt;
  }
  return dem ? sigma_beside(*dem) : std::nullopt;
}

StartPose chosen_start(const ReplayInputs& inputs, const Json& recorded, const MapStore& map) {
  if (inputs.start) return read_start_pose(*inputs.start);
  const fs::path own = recorded_dataset(recorded) / "start.toml";
  if (fs::is_regular_file(own)) return read_start_pose(own);
  return {.T_map_body = map.keyframe(0).T_map_body};
}

fs::path recorded_map(const fs::path& run) {
  const fs::path file = run / "map.db";
  if (!fs::is_regular_file(file))
    throw Error(run.string() + ": has no map.db; only a run that kept its map can be replayed");
  return file;
}

/// The recorded line of a frame that is no keyframe, with its position as it is estimated now.
std::string moved_line(const std::string& line, const Pose& T_map_body) {
  Json json = Json::parse(line);
  const Eigen::Vector3d& p = T_map_body.translation();
  json["position_m"] = {p.x(), p.y(), p.z()};
  return json.dump();
}

/// Feeds every recorded frame to the back-end and gives its lines of frames.jsonl.
std::string feed(Backend& backend, const MapStore& map, const Progress& progress) {
  std::string lines;
  const std::size_t keyframes = map.keyframe_count();
  for_each_recorded_frame(
      map,
      [&](const StoredFrame& frame, const FramePlace& place, Tracking status) {
        backend.repeat(place, status);
        lines += moved_line(frame.record, backend.T_map_keyframe(place.keyframe) * place.T_keyframe_body) + "\n";
      },
      [&](const StoredFrame& frame, RecordedKeyframe keyframe) {
        keyframe.odometry.features = map.features(keyframe.odometry.keyframe);
        FrameRecord record = backend.add(keyframe.odometry);
        record.index = frame.index;
        lines += frame_json(record) + "\n";
        progress.report(backend.keyframes(), keyframes);
      });
  return lines;
}

}  // namespace

RunReport replay(const ReplayInputs& inputs, const SlamOptions& options, const Progress& progress) {
  const Stopwatch stopwatch;
  const MapStore map = MapStore::open_read_only(recorded_map(inputs.run));
  const MapHeader header = map.header();
  const Json recorded = Json::parse(header.inputs);
  const auto dem_file = chosen_dem(inputs, recorded, options);
  const auto dem_sigma = chosen_sigma(inputs, recorded, dem_file);
  const auto dem = dem_file ? std::make_shared<const Dem>(open_dem(*dem_file, dem_sigma)) : nullptr;
  const Frontend frontend = make_frontend(options.frontend);
  Backend backend(header.rig, *frontend.matcher, dem, prior_of(chosen_start(inputs, recorded, map)), options,
                  [&](std::size_t keyframe) { return map.features(keyframe); });
  const fs::path sun = recorded_dataset(recorded) / "sun.csv";
  if (options.use_sun && fs::is_regular_file(sun)) backend.set_sun(read_sun(sun));
  RunFolder folder(inputs.output);
  if (folder.summary() && !inputs.overwrite) {
    throw Error(inputs.output.string() + ": already holds a run; choose another folder or pass --overwrite");
  }
  folder.clear();
  folder.write_config(inputs.config_toml);
  folder.begin(feed(backend, map, progress));
  RunReport report{.result = backend.finish(), .anchored = dem != nullptr};
  report.frames_in_dataset = report.frames_asked = report.result.counters.frames;
  folder.write_result(report.result, dem ? &dem->raster().frame : nullptr);
  folder.write_summary(summary_text({}, with_dem(header.inputs, dem_file, dem_sigma), report));
  report.seconds = stopwatch.elapsed_ms() * 1e-3;
  return report;
}

}  // namespace demslam

#include "demslam/slam/run.h"

#include <algorithm>
#include <future>
#include <numbers>
#include <ranges>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/image/rectify.h"
#include "demslam/slam/recorder.h"
#include "demslam/slam/run_folder.h"
#include "demslam/slam/summary.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

ImagePair load(const StereoSequence& sequence, const Rectifier& rectifier, std::size_t index) {
  const StereoFrame raw = sequence.frame(index);
  return {rectifier.left(raw.left), rectifier.right(raw.right)};
}

/// Reads, rectifies and observes the next frame while the present one is being tracked.
class Lookahead {
 public:
  using Observe = std::function<Observation(std::size_t index)>;
  Lookahead(Observe observe, std::size_t first, std::size_t end)
      : observe_(std::move(observe)), next_(first), end_(end) {
    start();
  }
  Observation take() {
    Observation observation = pending_.get();
    start();
    return observation;
  }

 private:
  void start() {
    if (next_ >= end_) return;
    pending_ = std::async(std::launch::async, [this, index = next_] { return observe_(index); });
    ++next_;
  }

  Observe observe_;
  std::size_t next_, end_;
  std::future<Observation> pending_;
};

std::optional<fs::path> chosen_dem(const RunInputs& inputs, const StereoSequence& sequence,
                                   const SlamOptions& options) {
  if (!options.use_dem) return std::nullopt;
  return inputs.dem ? inputs.dem : sequence.dem_file();
}

StartPose chosen_start(const RunInputs& inputs, const StereoSequence& sequence, bool anchored) {
  if (inputs.start) return read_start_pose(*inputs.start);
  if (const auto start = sequence.start()) return *start;
  if (anchored) {
    throw Error(
        inputs.dataset.string() +
        ": a DEM needs to know where the rover starts; pass --start FILE with T_map_body (see docs/datasets.md)");
  }
  return {};
}

/// No more than a circle to search in; the graph begins in a frame of its own.
StartPrior unknown_start(const RunInputs& inputs, const StereoSequence& sequence, const Dem* dem) {
  if (dem == nullptr) throw Error("--unknown-start needs a DEM to search in; pass --dem FILE");
  constexpr double kAnywhere_rad = 10.0;
  const auto start = inputs.start ? std::optional(read_start_pose(*inputs.start)) : sequence.start();
  const MapWindow extent = dem->raster().extent();
  const Eigen::Vector2d middle(0.5 * (extent.west_m + extent.east_m), 0.5 * (extent.south_m + extent.north_m));
  StartSearchOptions search;
  search.fix.centre_m = start ? Eigen::Vector2d(start->T_map_body.translation().head<2>()) : middle;
  search.fix.radius_m = inputs.unknown_start_radius_m;
  if (inputs.heading_deg) search.fix.heading_rad = *inputs.heading_deg * std::numbers::pi / 180.0;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kAnywhere_rad), Eigen::Vector3d::Constant(10.0 * search.fix.radius_m);
  return {Pose(), sigma.cwiseAbs2().asDiagonal(), search};
}

std::size_t last_frame(const RunInputs& inputs, const StereoSequence& sequence) {
  if (inputs.first_frame >= sequence.size()) {
    throw Error(inputs.dataset.string() + ": has " + std::to_string(sequence.size()) +
                " frames; the first one asked for is " + std::to_string(inputs.first_frame));
  }
  const std::size_t left = sequence.size() - inputs.first_frame;
  return inputs.first_frame + (inputs.max_frames == 0 ? left : std::min(left, inputs.max_frames));
}

MotionSensors read_sensors(const SensorFiles& files) {
  MotionSensors sensors;
  constexpr TimestampNs kImuPeriodNs = 100'000'000;
  if (files.imu) sensors.imu = read_imu(*files.imu, kImuPeriodNs);
  if (files.wheels) sensors.wheels = read_wheels(*files.wheels);
  return sensors;
}

/// Earlier pairs for the odometry's restart.
PairSource pair_source(const StereoSequence& sequence, const Rectifier& rectifier) {
  return [&](TimestampNs t_ns) -> ImagePair {
    const auto indices = std::views::iota(std::size_t(0), sequence.size());
    const auto index =
        *std::ranges::lower_bound(indices, t_ns, {}, [&](std::size_t i) { return sequence.stamp_ns(i); });
    return load(sequence, rectifier, index);
  };
}

/// The folder's map: an interrupted run's, to go on with, or a new one.
MapStore open_map(const RunInputs& inputs, RunFolder& folder, const MapHeader& header, std::size_t end) {
  if (inputs.overwrite) folder.clear();
  const auto summary = folder.summary();
  const fs::path file = folder.map_file();
  const bool begun = fs::exists(file);
  if (summary && (!begun || is_finished(*summary, end))) {
    throw Error(inputs.output.string() + ": already holds a finished run; choose another folder or pass --overwrite");
  }
  if (!begun) return MapStore::create(file, header);
  const MapHeader earlier = MapStore::open_read_only(file).header();
  if (earlier.version != header.version) {
    throw Error(inputs.output.string() + ": was begun by demslam " + earlier.version + ", this is " + header.version +
                "; go on with that one, or pass --overwrite to start anew");
  }
  check_same_run(inputs.output, earlier.inputs, header.inputs, earlier.config_toml, header.config_toml);
  return MapStore::open(file);
}

std::string stored_records(const MapStore& map) {
  std::string lines;
  map.for_each_frame([&](const StoredFrame& frame) { lines += frame.record + "\n"; });
  return lines;
}

void store(FrameRecord& record, Recorder& recorder) {
  const Stopwatch watch;
  recorder.add(record);
  record.store_ms = watch.elapsed_ms();
  record.total_ms += record.store_ms;
}

std::size_t next_frame(const MapStore& map, std::size_t first) {
  const std::size_t keyframes = map.keyframe_count();
  return keyframes == 0 ? first : map.keyframe(keyframes - 1).frame + 1;
}

}  // namespace

StartPrior prior_of(const StartPose& start) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(start.sigma_rotation_rad), Eigen::Vector3d::Constant(start.sigma_position_m);
  return {start.T_map_body, sigma.cwiseAbs2().asDiagonal()};
}

RunReport run_slam(const RunInputs& inputs, const SlamOptions& options, const Progress& progress) {
  const Stopwatch stopwatch;
  const auto sequence = inputs.open(inputs.dataset, inputs.format, inputs.calibration.value_or(""));
  const auto dem_file = chosen_dem(inputs, *sequence, options);
  const auto dem = dem_file ? std::make_shared<const Dem>(open_dem(*dem_file, sigma_file(inputs, dem_file))) : nullptr;
  const Rectifier rectifier(sequence->rig());
  Frontend frontend = make_frontend(options.frontend);
  const std::string inputs_json = inputs_text(inputs, *sequence, dem_file, options, frontend.inference);
  const std::size_t end = last_frame(inputs, *sequence);
  std::optional<MapStore> opened;  // once everything else has proved sound
  const StartPrior start = inputs.unknown_start_radius_m > 0.0
                               ? unknown_start(inputs, *sequence, dem.get())
                               : prior_of(chosen_start(inputs, *sequence, dem != nullptr));
  Slam slam(rectifier.rig(), std::move(frontend), dem, start, options,
            [&](std::size_t keyframe) { return opened->features(keyframe); });

  if (inputs.map) {
    slam.backend().use(std::make_unique<EarlierMap>(map_file(*inputs.map), rectifier.rig(), options.loops));
  }
  const SensorFiles sensors = sensor_files(inputs, *sequence, options);
  slam.odometry().set_sensors(read_sensors(sensors));
  if (sensors.sun) slam.backend().set_sun(read_sun(*sensors.sun));
  RunFolder folder(inputs.output);
  MapStore& map = opened.emplace(open_map(inputs, folder, {rectifier.rig(), inputs.config_toml, inputs_json}, end));
  resume(slam, map, pair_source(*sequence, rectifier));
  Recorder recorder(map, slam);
  const std::size_t first = next_frame(map, inputs.first_frame);
  folder.write_config(inputs.config_toml);
  folder.begin(stored_records(map));
  RunReport report{.frames_in_dataset = sequence->size(),
                   .frames_asked = end - inputs.first_frame,
                   .resumed_at = first,
                   .anchored = dem != nullptr};
  const auto write_results = [&] {
    report.result = slam.finish();
    const Vergence& vergence = slam.odometry().vergence();
    if (vergence.variance_rad2 > 0.0) report.vergence = vergence;
    recorder.finish(report.result);
    const bool found = !report.result.counters.anchoring.start_search.starts_with("no fix");
    const bool placed = dem && (found || inputs.unknown_start_radius_m == 0.0);
    folder.write_result(report.result, placed ? &dem->raster().frame : nullptr);
    folder.write_summary(summary_text(inputs, inputs_json, report));
  };

  try {
    const auto observe = [&](std::size_t index) {
      ImagePair pair = load(*sequence, rectifier, index);
      return slam.odometry().observe(sequence->stamp_ns(index), std::move(pair.left), std::move(pair.right));
    };
    Lookahead lookahead(observe, first, end);
    for (std::size_t index = first; index < end && !report.interrupted; ++index) {
      FrameRecord record = slam.process(lookahead.take());
      record.index = index;
      store(record, recorder);
      folder.append(record);
      progress.report(index + 1 - inputs.first_frame, report.frames_asked);
      report.interrupted = progress.stop_requested() && index + 1 < end;
    }
  } catch (const Error&) {  // a broken image in the middle, a full disk: keep what was done, then say what broke
    report.interrupted = true;
    try {
      write_results();
    } catch (const Error&) {  // NOLINT(bugprone-empty-catch): for the same reason; the map has all to the last keyframe
    }
    throw;
  }
  write_results();
  report.seconds = stopwatch.elapsed_ms() * 1e-3;
  return report;
}

}  // namespace demslam

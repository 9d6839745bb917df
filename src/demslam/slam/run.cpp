#include "demslam/slam/run.h"

#include <future>
#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/base/version.h"
#include "demslam/dataset/sequence.h"
#include "demslam/image/rectify.h"
#include "demslam/slam/run_folder.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

struct RectifiedFrame {
  TimestampNs t_ns = 0;
  Image left, right;
};

RectifiedFrame load(const StereoSequence& sequence, const Rectifier& rectifier, std::size_t index) {
  const StereoFrame raw = sequence.frame(index);
  return {raw.t_ns, rectifier.left(raw.left), rectifier.right(raw.right)};
}

/// Reads and rectifies the next frame while the present one is being worked on.
class Prefetch {
 public:
  Prefetch(const StereoSequence& sequence, const Rectifier& rectifier, std::size_t first, std::size_t end)
      : sequence_(sequence), rectifier_(rectifier), next_(first), end_(end) {
    start();
  }
  RectifiedFrame take() {
    RectifiedFrame frame = pending_.get();
    start();
    return frame;
  }

 private:
  void start() {
    if (next_ >= end_) return;
    pending_ = std::async(std::launch::async, [this, index = next_] { return load(sequence_, rectifier_, index); });
    ++next_;
  }

  const StereoSequence& sequence_;
  const Rectifier& rectifier_;
  std::size_t next_, end_;
  std::future<RectifiedFrame> pending_;
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

StartPrior prior_of(const StartPose& start) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(start.sigma_rotation_rad), Eigen::Vector3d::Constant(start.sigma_position_m);
  return {start.T_map_body, sigma.cwiseAbs2().asDiagonal()};
}

std::size_t last_frame(const RunInputs& inputs, const StereoSequence& sequence) {
  if (inputs.first_frame >= sequence.size()) {
    throw Error(inputs.dataset.string() + ": has " + std::to_string(sequence.size()) +
                " frames; the first one asked for is " + std::to_string(inputs.first_frame));
  }
  const std::size_t left = sequence.size() - inputs.first_frame;
  return inputs.first_frame + (inputs.max_frames == 0 ? left : std::min(left, inputs.max_frames));
}

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
            {"rejected", counters.loops.rejected}}},
          {"dem_factors",
           {{"height", counters.anchoring.height},
            {"normal", counters.anchoring.normal},
            {"skipped_outside", counters.anchoring.skipped_outside},
            {"skipped_tilt", counters.anchoring.skipped_tilt},
            {"patches", counters.anchoring.patches},
            {"patch_cells", counters.anchoring.patch_cells},
            {"skipped_patches", counters.anchoring.skipped_patches}}}};
}

Json inputs_json(const RunInputs& inputs, const StereoSequence& sequence, const std::optional<fs::path>& dem) {
  Json json = {{"dataset", fs::absolute(inputs.dataset).lexically_normal().string()}, {"format", sequence.format()}};
  for (const fs::path& file : sequence.definition_files()) json["files"].push_back(file_json(file));
  if (inputs.start) json["start"] = file_json(*inputs.start);
  if (dem) json["dem"] = file_json(*dem);
  return json;
}

std::string summary_json(const RunInputs& inputs, const StereoSequence& sequence, const std::optional<fs::path>& dem,
                         const SlamOptions& options, const RunReport& report) {
  Json models = Json::array();
  for (const fs::path& model : {options.frontend.extractor_model, options.frontend.matcher_model}) {
    if (!model.empty()) models.push_back(file_json(model));
  }
  const Trajectory& trajectory = report.result.trajectory;
  const Json json = {{"demslam", kVersion},
                     {"inputs", inputs_json(inputs, sequence, dem)},
                     {"models", models},
                     {"first_frame", inputs.first_frame},
                     {"frames_in_dataset", report.frames_in_dataset},
                     {"frames_asked", report.frames_asked},
                     {"interrupted", report.interrupted},
                     {"anchored", report.anchored},
                     {"counters", counters_json(report.result.counters)},
                     {"path_length_m", path_length_m(trajectory)},
                     {"first_to_last_m", first_to_last_m(trajectory)}};
  return json.dump(1) + "\n";
}

}  // namespace

RunReport run_slam(const RunInputs& inputs, const SlamOptions& options, const Progress& progress) {
  const Stopwatch stopwatch;
  const auto sequence = inputs.open(inputs.dataset, inputs.format, inputs.calibration.value_or(""));
  const auto dem_file = chosen_dem(inputs, *sequence, options);
  const auto dem = dem_file ? std::make_shared<const Dem>(read_dem(*dem_file)) : nullptr;
  const Rectifier rectifier(sequence->rig());
  Slam slam(rectifier.rig(), make_frontend(options.frontend), dem,
            prior_of(chosen_start(inputs, *sequence, dem != nullptr)), options);
  const std::size_t first = inputs.first_frame, end = last_frame(inputs, *sequence);

  RunFolder folder(inputs.output, inputs.overwrite);
  folder.write_config(inputs.config_toml);
  RunReport report{.frames_in_dataset = sequence->size(), .frames_asked = end - first, .anchored = dem != nullptr};
  const auto write_results = [&] {
    report.result = slam.finish();
    folder.write_result(report.result, dem ? &dem->raster().frame : nullptr);
    folder.write_summary(summary_json(inputs, *sequence, dem_file, options, report));
  };

  try {
    Prefetch prefetch(*sequence, rectifier, first, end);
    for (std::size_t index = first; index < end && !report.interrupted; ++index) {
      const RectifiedFrame frame = prefetch.take();
      FrameRecord record = slam.process(frame.t_ns, frame.left, frame.right);
      record.index = index;
      folder.append(record);
      progress.report(index + 1 - first, end - first);
      report.interrupted = progress.stop_requested() && index + 1 < end;
    }
  } catch (const Error&) {  // a broken image in the middle: keep what was done, then say what broke
    report.interrupted = true;
    write_results();
    throw;
  }
  write_results();
  report.seconds = stopwatch.elapsed_ms() * 1e-3;
  return report;
}

}  // namespace demslam

#include "demslam/experiment/drift_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "demslam/base/time.h"
#include "demslam/config/slam_config.h"
#include "demslam/evaluation/runs.h"
#include "demslam/experiment/finished_runs.h"
#include "demslam/sim/simulate.h"
#include "demslam/slam/run.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kDelta_m = 10.0;

/// A dataset with images, and what it is called.
struct Sequence {
  std::string name;
  fs::path data;
};

SlamOptions odometry_alone(const FrontendOptions& frontend, OdometryMethod method) {
  SlamOptions options;
  options.frontend = frontend;
  options.odometry.method = method;
  options.odometry.lost.use_imu = options.odometry.lost.use_wheels = false;
  options.use_dem = options.use_loops = options.use_sun = false;
  return options;
}

std::string file_name(std::string text) {
  std::ranges::replace_if(text, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return text;
}

Json json_of(const DriftRow& r) {
  return {{"sequence", r.sequence},
          {"frontend", r.frontend},
          {"method", to_string(r.method)},
          {"completion", r.completion},
          {"path_length_m", r.path_m},
          {"translation_percent_over_10m", r.translation_percent},
          {"rotation_deg_per_m_over_10m", r.rotation_deg_per_m},
          {"end_point_percent", r.end_percent},
          {"cpu_ms_per_frame", r.cpu_ms}};
}

/// JSON has no NaN: null stands for it.
double number(const Json& j) { return j.is_null() ? std::nan("") : j.get<double>(); }

DriftRow row_of(const Json& j, OdometryMethod method) {
  return {j["sequence"],
          j["frontend"],
          method,
          number(j["completion"]),
          number(j["path_length_m"]),
          number(j["translation_percent_over_10m"]),
          number(j["rotation_deg_per_m_over_10m"]),
          number(j["end_point_percent"]),
          number(j["cpu_ms_per_frame"])};
}

DriftRow evaluated(const fs::path& run) {
  const Evaluation e = evaluate_run(run, std::nullopt, {.rpe = {.delta = kDelta_m, .unit = DeltaUnit::metres}});
  return {.completion = e.completion,
          .path_m = e.path_length_m,
          .translation_percent = e.rpe ? 100.0 * e.rpe->rmse / kDelta_m : std::nan(""),
          .rotation_deg_per_m = e.rpe_rotation_deg ? e.rpe_rotation_deg->rmse / kDelta_m : std::nan(""),
          .end_percent = e.drift_percent};
}

/// One front-end and method on one sequence; nothing when stopped before its end.
std::optional<DriftRow> drift_of(const Sequence& sequence, const NamedFrontend& frontend, OdometryMethod method,
                                 const fs::path& out, const FinishedRuns& finished, const Progress& progress) {
  const std::string name = file_name(sequence.name + "_" + frontend.name + "_" + to_string(method));
  const SlamOptions options = odometry_alone(frontend.options, method);
  const RunInputs inputs{
      .dataset = sequence.data, .output = out / name, .overwrite = true, .config_toml = to_toml(options)};
  const std::string settings = Json{{"dataset", sequence.data.string()}, {"options", inputs.config_toml}}.dump();
  if (const auto earlier = finished.load(name, settings)) return row_of(Json::parse(*earlier), method);
  const CpuStopwatch watch;
  const RunReport report = run_slam(inputs, options, progress);
  if (report.interrupted) return std::nullopt;
  const double cpu_ms = watch.elapsed_ms() / static_cast<double>(report.frames_asked);
  DriftRow row = evaluated(inputs.output);
  row.sequence = sequence.name;
  row.frontend = frontend.name;
  row.method = method;
  row.cpu_ms = cpu_ms;
  finished.save(name, settings, json_of(row).dump());
  fs::remove(inputs.output / "map.db");  // the features of every keyframe: large, and needed no more
  return row;
}

Sequence simulated(StudyDrive drive, std::uint64_t seed, const fs::path& out, const Progress& progress) {
  drive.scene.seed = seed;
  const Sequence sequence{fmt::format("{}_s{}", drive.name, seed), study_folder(out, drive, seed) / "data"};
  simulate(drive.scene, sequence.data, progress);
  return sequence;
}

}  // namespace

std::vector<DriftRow> drift_experiment(const DriftExperiment& experiment, const fs::path& out,
                                       const Progress& progress) {
  const FinishedRuns finished(out);
  std::vector<DriftRow> rows;
  const auto run = [&](const Sequence& sequence) {
    for (const NamedFrontend& frontend : experiment.frontends) {
      for (const OdometryMethod method : experiment.methods) {
        if (progress.stop_requested()) return;
        const auto row = drift_of(sequence, frontend, method, out, finished, progress);
        if (row) rows.push_back(*row);
      }
    }
  };
  for (const std::uint64_t seed : experiment.seeds) {
    for (const StudyDrive& drive : experiment.drives) {
      if (!progress.stop_requested()) run(simulated(drive, seed, out, progress));
    }
  }
  for (const fs::path& data : experiment.sequences) run({data.filename().string(), data});
  return rows;
}

Table drift_table(const std::vector<DriftRow>& rows) {
  Table table{.title =
                  "Odometry alone. Drift: RPE over 10 m of the truth, RMSE, per metre; end point: unaligned, over "
                  "the path. CPU milliseconds per frame, images read included",
              .header = {"sequence", "front-end", "method", "tracked [%]", "path [m]", "drift [%]", "drift [deg/m]",
                         "end point [%]", "CPU [ms]"}};
  for (const DriftRow& r : rows) {
    table.rows.push_back({r.sequence, r.frontend, to_string(r.method), fmt::format("{:.1f}", 100.0 * r.completion),
                          fmt::format("{:.1f}", r.path_m), fmt::format("{:.3f}", r.translation_percent),
                          fmt::format("{:.4f}", r.rotation_deg_per_m), fmt::format("{:.3f}", r.end_percent),
                          fmt::format("{:.0f}", r.cpu_ms)});
  }
  return table;
}

std::string drift_json(const std::vector<DriftRow>& rows) {
  Json all = Json::array();
  for (const DriftRow& row : rows) all.push_back(json_of(row));
  return all.dump(1) + "\n";
}

}  // namespace demslam

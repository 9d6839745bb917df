#include "demslam/report/run_report.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/report/map_picture.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// Okabe-Ito colours, told apart by colour-blind readers too; the page has the same in the same order.
constexpr std::array<Colour, 5> kRunColours{
    {{213, 94, 0}, {0, 114, 178}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}}};
constexpr Colour kTruthColour{250, 250, 250};

nlohmann::json parsed_summary(const ReportRun& run) {
  const auto json = nlohmann::json::parse(run.summary, nullptr, false);
  if (json.is_discarded()) throw Error(run.folder.string() + ": no run folder (summary.json is missing or broken)");
  return json;
}

std::optional<fs::path> dem_of(const ReportRun& run) {
  const nlohmann::json summary = parsed_summary(run);
  const nlohmann::json::json_pointer path("/inputs/dem/path");
  if (!summary.contains(path)) return std::nullopt;
  return fs::path(summary[path].get<std::string>());
}

std::string text_or_empty(const fs::path& file) { return fs::exists(file) ? read_text(file) : std::string(); }

std::string name_of(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
}

ReportRun read_run(const fs::path& folder, const std::optional<fs::path>& truth) {
  ReportRun run{.name = name_of(folder), .folder = folder, .summary = text_or_empty(folder / "summary.json")};
  parsed_summary(run);
  run.config = text_or_empty(folder / "config.toml");
  run.trajectory = read_trajectory(folder / "trajectory.tum").poses;
  if (fs::exists(folder / "odometry.tum")) run.odometry = read_trajectory(folder / "odometry.tum").poses;
  run.frames = read_frame_lines(folder);
  run.timings = read_timings(folder);
  run.covariances = read_covariances(folder);
  if (truth) run.evaluation = evaluate_run(folder, truth, {});
  return run;
}

std::string label_of(const ReportRun& run) {
  if (!run.evaluation) return run.name;
  return fmt::format("{}: ATE {:.2f} m, no alignment", run.name, run.evaluation->ate.rmse);
}

std::vector<MapTrack> tracks_of(const Report& report) {
  std::vector<MapTrack> tracks;
  if (report.truth) tracks.push_back({"truth", kTruthColour, *report.truth});
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    tracks.push_back({label_of(report.runs[i]), kRunColours[i % kRunColours.size()], report.runs[i].trajectory});
  }
  return tracks;
}

}  // namespace

Report read_report(const std::vector<fs::path>& runs, const std::optional<fs::path>& truth,
                   const std::optional<fs::path>& dem) {
  Report report{.runs = {}, .truth = {}, .dem = dem};
  for (const fs::path& folder : runs) {
    const auto true_file = truth ? truth : find_truth(folder);
    if (true_file && !report.truth) report.truth = read_truth(*true_file).poses;
    report.runs.push_back(read_run(folder, true_file));
    if (!report.dem) report.dem = dem_of(report.runs.back());
  }
  return report;
}

void write_map_picture(const Report& report, const fs::path& file) {
  if (!report.dem) throw Error("report: no run was anchored to a DEM; name one with --dem to draw the map");
  draw_map_picture(Dem(read_dem(*report.dem)), tracks_of(report), {}).write(file);
}

}  // namespace demslam

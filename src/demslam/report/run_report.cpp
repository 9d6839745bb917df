#include "demslam/report/run_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/evaluation/truth.h"
#include "demslam/report/internal/run_colours.h"
#include "demslam/report/map_picture.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr Colour kTruthColour{250, 250, 250};

void check_summary(const ReportRun& run) {
  if (nlohmann::json::accept(run.summary)) return;
  throw Error(run.folder.string() + ": no run folder (summary.json is missing or broken)");
}

std::string text_or_empty(const fs::path& file) { return fs::exists(file) ? read_text(file) : std::string(); }

std::string name_of(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
}

ReportRun read_run(const fs::path& folder) {
  ReportRun run{.name = name_of(folder), .folder = folder, .summary = text_or_empty(folder / "summary.json")};
  check_summary(run);
  run.config = text_or_empty(folder / "config.toml");
  run.trajectory = read_trajectory(folder / "trajectory.tum").poses;
  if (fs::exists(folder / "odometry.tum")) run.odometry = read_trajectory(folder / "odometry.tum").poses;
  run.frames = read_frame_lines(folder);
  run.timings = read_timings(folder);
  run.covariances = read_covariances(folder);
  return run;
}

/// Read as `demslam evaluate` reads it; geodetic truths go through the report's DEM.
void add_truth(Report& report, ReportRun& run, const std::optional<fs::path>& truth) {
  if (!truth) return;
  if (!report.truth) report.truth = read_truth(*truth, {.dem = report.dem}).file.poses;
  run.evaluation = evaluate_run(run.folder, truth, {}, {.dem = report.dem});
}

std::string label_of(const ReportRun& run) {
  if (!run.evaluation) return run.name;
  return fmt::format("{}: ATE {:.2f} m, no alignment", run.name, run.evaluation->ate.rmse);
}

std::vector<MapTrack> tracks_of(const Report& report) {
  std::vector<MapTrack> tracks;
  if (report.truth) tracks.push_back({"truth", kTruthColour, *report.truth});
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    tracks.push_back({label_of(report.runs[i]), run_colour(i), report.runs[i].trajectory});
  }
  return tracks;
}

}  // namespace

Report read_report(const std::vector<fs::path>& runs, const std::optional<fs::path>& truth,
                   const std::optional<fs::path>& dem) {
  Report report{.runs = {}, .truth = {}, .dem = dem, .notes = {}};
  for (const fs::path& folder : runs) {
    report.runs.push_back(read_run(folder));
    if (!report.dem) report.dem = dem_of_run(folder);
  }
  for (ReportRun& run : report.runs) {
    try {
      add_truth(report, run, truth_file(run.folder, truth));
    } catch (const Error& error) {
      if (truth) throw;  // asked for
      report.notes.push_back(run.name + ": no errors are shown (" + error.what() + ")");
    }
  }
  return report;
}

void write_map_picture(const Report& report, const fs::path& file) {
  if (!report.dem) throw Error("report: no run was anchored to a DEM; name one with --dem to draw the map");
  draw_map_picture(Dem(read_dem(*report.dem)), tracks_of(report), {}).write(file);
}

}  // namespace demslam

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/evaluation/evaluate.h"
#include "demslam/evaluation/runs.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/report/run_files.h"

namespace demslam {

/// A run folder as a report shows it; read from its files alone.
struct ReportRun {
  std::string name;
  std::filesystem::path folder;
  Trajectory trajectory, odometry;  ///< T_map_body; odometry is empty where its file is missing
  std::vector<FrameLine> frames;
  Columns timings;  ///< a row per frame
  std::vector<StampedCovariance> covariances;
  std::string summary, config;           ///< summary.json, config.toml
  std::optional<Evaluation> evaluation;  ///< where the truth was found
};

/// What a report is made of: runs over one terrain.
struct Report {
  std::vector<ReportRun> runs;
  std::optional<Trajectory> truth;
  std::optional<std::filesystem::path> dem;  ///< the first anchored run's
  std::vector<std::string> notes;            ///< what could not be read
};

/// Throws Error when a run folder is incomplete. `truth` and `dem` replace what the runs name. A truth that was found
/// with a run's dataset and cannot be used is a note.
Report read_report(const std::vector<std::filesystem::path>& runs, const std::optional<std::filesystem::path>& truth,
                   const std::optional<std::filesystem::path>& dem);

/// The tracks over the shaded DEM, as PNG. Throws Error when no run names a DEM.
void write_map_picture(const Report& report, const std::filesystem::path& file);

}  // namespace demslam

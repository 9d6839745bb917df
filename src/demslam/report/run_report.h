#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/evaluation/evaluate.h"
#include "demslam/geometry/trajectory.h"

namespace demslam {

/// A run folder as a report shows it; read from its files alone.
struct ReportRun {
  std::string name;
  Trajectory trajectory;
  std::optional<Evaluation> evaluation;  ///< where the truth was found
};

/// What a report is made of: runs over one terrain.
struct Report {
  std::vector<ReportRun> runs;
  std::optional<Trajectory> truth;
  std::optional<std::filesystem::path> dem;  ///< the first anchored run's
  std::string summary;                       ///< the first run's summary.json
};

/// Throws Error when a run folder is incomplete. `truth` and `dem` replace what the runs name.
Report read_report(const std::vector<std::filesystem::path>& runs, const std::optional<std::filesystem::path>& truth,
                   const std::optional<std::filesystem::path>& dem);

/// The tracks over the shaded DEM, as PNG. Throws Error when no run names a DEM.
void write_map_picture(const Report& report, const std::filesystem::path& file);

/// One self-contained HTML page: map, table, errors over distance. Opens offline.
void write_html(const Report& report, const std::filesystem::path& file);

}  // namespace demslam

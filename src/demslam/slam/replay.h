#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "demslam/base/progress.h"
#include "demslam/slam/run.h"

namespace demslam {

/// What a replay reads and where it writes.
struct ReplayInputs {
  std::filesystem::path run;                 ///< run folder with its map.db
  std::optional<std::filesystem::path> dem;  ///< default: the recorded run's own
  std::optional<std::filesystem::path>
      start;                     ///< start.toml; default: the recorded run's first pose, known to 0.1 m and 0.1 deg
  std::filesystem::path output;  ///< the new run folder
  bool overwrite = false;
  std::string config_toml;  ///< effective options as text, stored beside the result
};

/// Solves a recorded run again: its odometry and features as they are in its map, other options behind them or another
/// DEM. No image is read; a replay takes milliseconds per keyframe. The front-end and odometry options have no effect.
/// Throws Error.
RunReport replay(const ReplayInputs& inputs, const SlamOptions& options, const Progress& progress = {});

}  // namespace demslam

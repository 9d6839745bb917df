#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/dem/local_frame.h"
#include "demslam/evaluation/trajectory_io.h"

namespace demslam {

/// How a truth is to be understood that speaks of longitude, latitude and height, or of another clock.
struct TruthOptions {
  std::optional<std::filesystem::path> dem;  ///< into whose map geodetic positions are brought; default: the run's own
  std::optional<HeightDatum> dem_heights;    ///< default: what the DEM says of itself
  std::optional<double> geoid_undulation_m;  ///< geoid above the ellipsoid, where the DEM's heights count from a geoid
  int worst_quality = 1;                     ///< RTKLIB's Q; poorer fixes are left out
  double clock_offset_s = 0.0;               ///< added to the estimate's stamps
  bool estimate_clock_offset = false;        ///< instead: estimate_clock_offset()
};

/// A truth in the map, and what was done to bring it there.
struct Truth {
  TrajectoryFile file;
  std::vector<std::string> notes;
};

/// Reads a truth as poses of our body in the map: read_trajectory(), LuSNAR's own axes turned into ours, geodetic
/// positions (is_geodetic()) through the CRS of `options.dem` and, where its heights count from a geoid, lowered by the
/// undulation. Throws Error when a geodetic truth meets no DEM, a DEM on another body, or one that does not say what
/// its heights count from.
Truth read_truth(const std::filesystem::path& file, const TruthOptions& options);
TrajectoryFile read_truth(const std::filesystem::path& file);

}  // namespace demslam

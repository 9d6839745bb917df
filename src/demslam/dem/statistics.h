#pragma once

#include <cstddef>
#include <filesystem>

#include "demslam/dem/dem.h"

namespace demslam {

/// What `demslam dem info` prints. Heights are the file's own (origin height added back); all zero without a valid
/// cell.
struct DemStatistics {
  std::size_t cells = 0, holes = 0;
  double min_m = 0.0, max_m = 0.0, mean_m = 0.0;
  /// Central differences, where all four neighbours exist; of a raster with more than 4 million cells, a sample of
  /// them.
  double slope_median_deg = 0.0, slope_p95_deg = 0.0;

  double hole_fraction() const { return cells == 0 ? 0.0 : static_cast<double>(holes) / static_cast<double>(cells); }
};

DemStatistics statistics(const DemRaster& dem);

/// Of a file of any size, read in strips.
DemStatistics statistics(const std::filesystem::path& dem_file);

/// Central-difference gradient at a cell centre; NaN at the border and next to holes.
Eigen::Vector2d cell_gradient(const DemRaster& dem, int row, int col);

}  // namespace demslam

#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "demslam/dem/dem.h"

namespace demslam {

/// A piece of a DEM as a page shows it: square posts at map positions, row 0 in the North.
struct TerrainGrid {
  int rows = 0, cols = 0;
  double step_m = 0.0;                 ///< between two posts
  double west_m = 0.0, north_m = 0.0;  ///< of the first post
  std::vector<float> heights_m;        ///< map z; NaN: no data

  float at(int row, int col) const { return heights_m[static_cast<std::size_t>(row) * cols + col]; }
};

/// The ground under `box` and around it, at most `max_side` posts a side. Finer than the DEM's cells: interpolated as
/// the run itself does it; coarser: the mean of the cells around each post. Nothing when the box lies outside the DEM.
std::optional<TerrainGrid> terrain_around(const Dem& dem, const Eigen::AlignedBox2d& box, int max_side);

}  // namespace demslam

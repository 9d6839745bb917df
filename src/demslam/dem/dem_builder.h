#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "demslam/dem/dem.h"

namespace demslam {

struct DemBuildOptions {
  double cell_m = 1.0;
  int min_points = 3;          ///< a cell with fewer is a hole
  double sigma_pose_m = 0.05;  ///< vertical error of the poses, common to all points of a cell
};

/// A rasterised cloud; three rasters on one grid.
struct BuiltDem {
  DemRaster heights;        ///< mean of the points of a cell
  DemRaster sigma, counts;  ///< of the mean's error, metres; points per cell (0 at holes); origin's height 0
  std::int64_t points = 0;
  std::size_t filled = 0;  ///< cells that are no holes

  double hole_fraction() const {
    return 1.0 - static_cast<double>(filled) / static_cast<double>(heights.heights.size());
  }
};

/// Rasterises points of the map frame: each cell gets the mean height of its points, and as its sigma
/// hypot(scatter / sqrt(points), sigma_pose). Cell corners lie at multiples of the cell size; the raster is as large as
/// the points need. The sums are kept per cell, so a cloud of any size passes through.
class DemBuilder {
 public:
  explicit DemBuilder(const DemBuildOptions& options);

  void add(const Eigen::Vector3d& p_map);
  /// Throws Error when no cell has enough points, or when they spread over more than 100 million cells.
  BuiltDem finish(const LocalFrame& frame) const;

 private:
  struct Cell {
    std::int64_t count = 0;
    double mean = 0.0, squares = 0.0;  ///< Welford's
    void add(double z);
    double scatter() const;  ///< standard deviation; of two points and more
  };
  using Index = std::pair<std::int32_t, std::int32_t>;  ///< northward row, eastward column

  double usual_scatter_m() const;

  DemBuildOptions options_;
  std::map<Index, Cell> cells_;
  std::map<Index, Cell>::iterator last_;  ///< neighbouring points fall into the same cell
};

}  // namespace demslam

#include "demslam/report/terrain_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace demslam {
namespace {

using Box = Eigen::AlignedBox2d;
constexpr double kMargin = 0.35;  ///< of the box's longer side, on each side
constexpr double kMinMargin_m = 15.0;
constexpr double kPostsPerCell = 5.0;  ///< where a DEM is coarser than the picture

Box ground_of(const DemRaster& raster, const Box& box) {
  const MapWindow extent = raster.extent();
  const double margin = std::max(kMargin * box.sizes().maxCoeff(), kMinMargin_m);
  const Eigen::Vector2d m(margin, margin);
  return Box(box.min() - m, box.max() + m)
      .intersection(
          Box(Eigen::Vector2d(extent.west_m, extent.south_m), Eigen::Vector2d(extent.east_m, extent.north_m)));
}

/// The mean of the cells whose centres lie within half a step of (x, y).
float mean_around(const DemRaster& raster, double x, double y, double step) {
  const auto col = [&](double at) { return std::clamp(int((at - raster.west_m) / raster.cell_m), 0, raster.cols - 1); };
  const auto row = [&](double at) {
    return std::clamp(int((raster.north_m - at) / raster.cell_m), 0, raster.rows - 1);
  };
  double sum = 0.0;
  int count = 0;
  for (int r = row(y + 0.5 * step); r <= row(y - 0.5 * step); ++r) {
    for (int c = col(x - 0.5 * step); c <= col(x + 0.5 * step); ++c) {
      if (std::isnan(raster.at(r, c))) continue;
      sum += raster.at(r, c);
      ++count;
    }
  }
  return count == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(sum / count);
}

float height_at(const Dem& dem, double x, double y, double step) {
  if (step > 1.5 * dem.raster().cell_m) return mean_around(dem.raster(), x, y, step);
  const auto height = dem.height(x, y);
  return height ? static_cast<float>(*height) : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

std::optional<TerrainGrid> terrain_around(const Dem& dem, const Box& box, int max_side) {
  const Box ground = ground_of(dem.raster(), box);
  if (ground.isEmpty() || ground.sizes().minCoeff() <= 0.0) return std::nullopt;
  const double step = std::max(ground.sizes().maxCoeff() / (max_side - 1), dem.raster().cell_m / kPostsPerCell);
  TerrainGrid grid{.rows = int(ground.sizes().y() / step) + 1,
                   .cols = int(ground.sizes().x() / step) + 1,
                   .step_m = step,
                   .west_m = ground.min().x(),
                   .north_m = ground.max().y()};
  for (int row = 0; row < grid.rows; ++row) {
    for (int col = 0; col < grid.cols; ++col) {
      grid.heights_m.push_back(height_at(dem, grid.west_m + col * step, grid.north_m - row * step, step));
    }
  }
  return grid;
}

}  // namespace demslam

#include "demslam/dem/dem_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr double kMostCells = 1e8;
constexpr double kFarthest_m = 1e7;  // from the map's origin
constexpr std::int64_t kLeastForScatter = 3;
constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

struct Bounds {
  std::int32_t south = std::numeric_limits<std::int32_t>::max(), west = south;
  std::int32_t north = std::numeric_limits<std::int32_t>::min(), east = north;

  void include(std::int32_t row, std::int32_t col) {
    south = std::min(south, row);
    north = std::max(north, row);
    west = std::min(west, col);
    east = std::max(east, col);
  }
  double cells() const { return (static_cast<double>(north) - south + 1.0) * (static_cast<double>(east) - west + 1.0); }
};

DemRaster empty_raster(const Bounds& bounds, double cell_m, const LocalFrame& frame, float value) {
  DemRaster raster{.rows = bounds.north - bounds.south + 1, .cols = bounds.east - bounds.west + 1, .cell_m = cell_m};
  raster.west_m = bounds.west * cell_m;
  raster.north_m = (bounds.north + 1) * cell_m;
  raster.frame = frame;
  raster.heights.assign(static_cast<std::size_t>(raster.rows) * raster.cols, value);
  return raster;
}

LocalFrame at_height_zero(LocalFrame frame) {
  frame.origin.z() = 0.0;
  frame.heights = HeightDatum::unstated;
  return frame;
}

}  // namespace

void DemBuilder::Cell::add(double z) {
  ++count;
  const double before = z - mean;
  mean += before / static_cast<double>(count);
  squares += before * (z - mean);
}

double DemBuilder::Cell::scatter() const { return std::sqrt(squares / static_cast<double>(count - 1)); }

DemBuilder::DemBuilder(const DemBuildOptions& options) : options_(options), last_(cells_.end()) {
  if (!(options.cell_m >= 0.01) || options.min_points < 1 || !(options.sigma_pose_m > 0.0)) {
    throw Error("dem build: cells of 0.01 m and more, one point per cell and more, and a positive pose sigma");
  }
}

void DemBuilder::add(const Eigen::Vector3d& p_map) {
  if (!p_map.allFinite() || p_map.head<2>().cwiseAbs().maxCoeff() > kFarthest_m) {
    throw Error("dem build: a point lies at (" + std::to_string(p_map.x()) + ", " + std::to_string(p_map.y()) + ", " +
                std::to_string(p_map.z()) + ") m of the map; check the poses and the units");
  }
  const Index index{static_cast<std::int32_t>(std::floor(p_map.y() / options_.cell_m)),
                    static_cast<std::int32_t>(std::floor(p_map.x() / options_.cell_m))};
  if (last_ == cells_.end() || last_->first != index) last_ = cells_.try_emplace(index).first;
  last_->second.add(p_map.z());
}

/// What two points or fewer scatter is not known: the median of the other cells' is taken.
double DemBuilder::usual_scatter_m() const {
  std::vector<double> scatters;
  for (const auto& [index, cell] : cells_) {
    if (cell.count >= kLeastForScatter) scatters.push_back(cell.scatter());
  }
  if (scatters.empty()) return options_.sigma_pose_m;
  const auto middle = scatters.begin() + static_cast<std::ptrdiff_t>(scatters.size() / 2);
  std::nth_element(scatters.begin(), middle, scatters.end());
  return *middle;
}

BuiltDem DemBuilder::finish(const LocalFrame& frame) const {
  Bounds bounds;
  for (const auto& [index, cell] : cells_) {
    if (cell.count >= options_.min_points) bounds.include(index.first, index.second);
  }
  if (bounds.south > bounds.north) {
    throw Error("dem build: no cell has " + std::to_string(options_.min_points) +
                " points; take larger cells or fewer points per cell");
  }
  if (bounds.cells() > kMostCells) throw Error("dem build: the points spread over too many cells; check the poses");
  BuiltDem built{.heights = empty_raster(bounds, options_.cell_m, frame, kHole)};
  built.sigma = empty_raster(bounds, options_.cell_m, at_height_zero(frame), kHole);
  built.counts = empty_raster(bounds, options_.cell_m, at_height_zero(frame), 0.0F);
  const double usual_m = usual_scatter_m();
  for (const auto& [index, cell] : cells_) {
    built.points += cell.count;
    if (cell.count < options_.min_points) continue;
    const int row = bounds.north - index.first, col = index.second - bounds.west;
    const double scatter_m = cell.count >= kLeastForScatter ? cell.scatter() : usual_m;
    built.heights.at(row, col) = static_cast<float>(cell.mean);
    built.counts.at(row, col) = static_cast<float>(cell.count);
    built.sigma.at(row, col) =
        static_cast<float>(std::hypot(scatter_m / std::sqrt(static_cast<double>(cell.count)), options_.sigma_pose_m));
    ++built.filled;
  }
  return built;
}

}  // namespace demslam

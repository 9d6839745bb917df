#include "demslam/sim/dem_product.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

constexpr int kSamplesPerCell = 8;  // along each axis

struct Extent {
  double west, south, east, north;
};

Extent around(const Trajectory& trajectory, double margin) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Extent extent{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const StampedPose& stamped : trajectory) {
    const Eigen::Vector3d& p = stamped.pose.translation();
    extent = {std::min(extent.west, p.x()), std::min(extent.south, p.y()), std::max(extent.east, p.x()),
              std::max(extent.north, p.y())};
  }
  return {extent.west - margin, extent.south - margin, extent.east + margin, extent.north + margin};
}

/// An empty product on a grid of multiples of the cell, inside both the extent and the base.
DemRaster grid(const Terrain& terrain, const Extent& wanted, double cell) {
  const DemRaster& base = terrain.base().raster();
  const double west = std::max(wanted.west, base.west_m),
               east = std::min(wanted.east, base.west_m + base.cols * base.cell_m);
  const double north = std::min(wanted.north, base.north_m),
               south = std::max(wanted.south, base.north_m - base.rows * base.cell_m);
  DemRaster product;
  product.frame = base.frame;
  product.cell_m = cell;
  product.west_m = std::ceil(west / cell) * cell;
  product.north_m = std::floor(north / cell) * cell;
  product.cols = std::max(1, static_cast<int>(std::floor((east - product.west_m) / cell)));
  product.rows = std::max(1, static_cast<int>(std::floor((product.north_m - south) / cell)));
  product.heights.resize(static_cast<std::size_t>(product.rows) * product.cols);
  return product;
}

void fill_row(const Terrain& terrain, DemRaster& product, int row) {
  const double step = product.cell_m / kSamplesPerCell, south = product.north_m - (row + 1) * product.cell_m;
  Patch samples(product.west_m + 0.5 * step, south + 0.5 * step, step, product.cols * kSamplesPerCell, kSamplesPerCell);
  terrain.fill_ground(samples);
  for (int col = 0; col < product.cols; ++col) {
    const Eigen::Vector2d centre = product.centre(row, col);
    if (terrain.base().is_hole(centre.x(), centre.y())) {
      product.at(row, col) = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    double sum = 0.0;
    for (int iy = 0; iy < kSamplesPerCell; ++iy) {
      for (int ix = 0; ix < kSamplesPerCell; ++ix) sum += samples.at(col * kSamplesPerCell + ix, iy);
    }
    product.at(row, col) = static_cast<float>(sum / (kSamplesPerCell * kSamplesPerCell));
  }
}

/// Columns that an altimeter has flown over, in order: the first, the last, and one at a jittered distance from the
/// next.
std::vector<int> flown_columns(const DemRaster& dem, double spacing_m, std::uint64_t seed) {
  Random random(seed, 0x6c6f6c61);
  std::vector<int> columns{0};
  for (double x = 0.0; columns.back() < dem.cols - 1;) {
    x += spacing_m / dem.cell_m * random.uniform(0.4, 1.6);
    const int column = std::min(static_cast<int>(x), dem.cols - 1);
    if (column > columns.back()) columns.push_back(column);
  }
  return columns;
}

/// Replaces what lies between two tracks by a straight line; holes stay holes.
void interpolate_between(DemRaster& dem, int from, int to) {
  for (int row = 0; row < dem.rows; ++row) {
    const float west = dem.at(row, from), east = dem.at(row, to);
    for (int col = from + 1; col < to; ++col) {
      const float share = static_cast<float>(col - from) / static_cast<float>(to - from);
      if (std::isfinite(dem.at(row, col))) dem.at(row, col) = west + share * (east - west);
    }
  }
}

}  // namespace

DemRaster averaged_ground(const Terrain& terrain, const Trajectory& trajectory, const DemProductOptions& options) {
  DemRaster product = grid(terrain, around(trajectory, options.margin_m), options.cell_m);
  tbb::parallel_for(0, product.rows, [&](int row) { fill_row(terrain, product, row); });
  return product;
}

DemRaster degraded(const DemRaster& truth, const DemProductOptions& options, std::uint64_t seed) {
  DemRaster measured = truth;
  if (options.track_spacing_m > 0.0) {
    const std::vector<int> columns = flown_columns(measured, options.track_spacing_m, seed);
    for (std::size_t i = 0; i + 1 < columns.size(); ++i) interpolate_between(measured, columns[i], columns[i + 1]);
  }
  Perturbation perturbation;
  perturbation.noise_m = {options.noise_rms_m, options.correlation_m, Random::mix(seed ^ 0x64656dULL)};
  perturbation.bias_m = options.bias_m;
  perturbation.shift_m = options.shift_m;
  return perturb(std::move(measured), perturbation);
}

}  // namespace demslam

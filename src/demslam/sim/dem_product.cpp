#include "demslam/sim/dem_product.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

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
  terrain.fill(samples);
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

}  // namespace

DemRaster averaged_ground(const Terrain& terrain, const Trajectory& trajectory, const DemProductOptions& options) {
  DemRaster product = grid(terrain, around(trajectory, options.margin_m), options.cell_m);
  tbb::parallel_for(0, product.rows, [&](int row) { fill_row(terrain, product, row); });
  return product;
}

DemRaster degraded(const DemRaster& truth, const DemProductOptions& options, std::uint64_t seed) {
  Perturbation perturbation;
  perturbation.noise_m = {options.noise_rms_m, options.correlation_m, Random::mix(seed ^ 0x64656dULL)};
  perturbation.bias_m = options.bias_m;
  perturbation.shift_m = options.shift_m;
  return perturb(truth, perturbation);
}

}  // namespace demslam

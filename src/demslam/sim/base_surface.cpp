#include "demslam/sim/base_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/random.h"

namespace demslam {
namespace {

/// Index of a cell on an endless axis that mirrors the raster at its edges.
int mirrored(std::int64_t index, int count) {
  const std::int64_t period = 2LL * count;
  std::int64_t m = index % period;
  if (m < 0) m += period;
  return static_cast<int>(m < count ? m : period - 1 - m);
}

/// Four neighbours along one axis and their Catmull-Rom weights.
struct Taps {
  std::array<int, 4> index;
  std::array<double, 4> weight;
};

Taps taps(double position, int count) {
  const double floor = std::floor(position), t = position - floor;
  const auto first = static_cast<std::int64_t>(floor) - 1;
  Taps result;
  for (int k = 0; k < 4; ++k) result.index[k] = mirrored(first + k, count);
  result.weight = {0.5 * t * (t * (2.0 - t) - 1.0), 0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
                   0.5 * t * (t * (4.0 - 3.0 * t) + 1.0), 0.5 * t * t * (t - 1.0)};
  return result;
}

double column_position(const DemRaster& raster, double x) { return (x - raster.west_m) / raster.cell_m - 0.5; }
double row_position(const DemRaster& raster, double y) { return (raster.north_m - y) / raster.cell_m - 0.5; }

std::vector<bool> holes_of(const DemRaster& raster) {
  std::vector<bool> holes(raster.heights.size());
  for (std::size_t i = 0; i < holes.size(); ++i) holes[i] = !std::isfinite(raster.heights[i]);
  return holes;
}

DemRaster filled(DemRaster raster) {
  fill_holes(raster);
  return raster;
}

/// Half-resolution raster: the mean of the known cells of each 2 x 2 block, NaN where none is known.
DemRaster halved(const DemRaster& raster) {
  DemRaster half = raster;
  half.rows = (raster.rows + 1) / 2;
  half.cols = (raster.cols + 1) / 2;
  half.heights.assign(static_cast<std::size_t>(half.rows) * half.cols, std::nanf(""));
  for (int row = 0; row < half.rows; ++row) {
    for (int col = 0; col < half.cols; ++col) {
      double sum = 0.0;
      int known = 0;
      for (int k = 0; k < 4; ++k) {
        const int r = std::min(2 * row + k / 2, raster.rows - 1), c = std::min(2 * col + k % 2, raster.cols - 1);
        if (!std::isfinite(raster.at(r, c))) continue;
        sum += raster.at(r, c);
        ++known;
      }
      if (known > 0) half.at(row, col) = static_cast<float>(sum / known);
    }
  }
  return half;
}

/// Relaxes the unknown cells towards the mean of their neighbours (Gauss-Seidel on Laplace's equation).
void relax(DemRaster& raster, const std::vector<bool>& hole, int sweeps) {
  const auto clamped = [&](int row, int col) {
    return raster.at(std::clamp(row, 0, raster.rows - 1), std::clamp(col, 0, raster.cols - 1));
  };
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (int row = 0; row < raster.rows; ++row) {
      for (int col = 0; col < raster.cols; ++col) {
        if (!hole[static_cast<std::size_t>(row) * raster.cols + col]) continue;
        raster.at(row, col) =
            0.25F * (clamped(row - 1, col) + clamped(row + 1, col) + clamped(row, col - 1) + clamped(row, col + 1));
      }
    }
  }
}

}  // namespace

BaseSurface::BaseSurface(DemRaster raster) : hole_(holes_of(raster)), raster_(filled(std::move(raster))) {}

void BaseSurface::add_to(Patch& patch) const {
  std::vector<Taps> columns(patch.nx);
  for (int ix = 0; ix < patch.nx; ++ix) columns[ix] = taps(column_position(raster_, patch.x(ix)), raster_.cols);
  for (int iy = 0; iy < patch.ny; ++iy) {
    const Taps rows = taps(row_position(raster_, patch.y(iy)), raster_.rows);
    double* out = patch.row(iy);
    for (int ix = 0; ix < patch.nx; ++ix) {
      const Taps& cols = columns[ix];
      for (int k = 0; k < 4; ++k) {
        const float* row = raster_.heights.data() + static_cast<std::size_t>(rows.index[k]) * raster_.cols;
        out[ix] += rows.weight[k] * (cols.weight[0] * row[cols.index[0]] + cols.weight[1] * row[cols.index[1]] +
                                     cols.weight[2] * row[cols.index[2]] + cols.weight[3] * row[cols.index[3]]);
      }
    }
  }
}

bool BaseSurface::inside(double x_m, double y_m) const {
  const double col = column_position(raster_, x_m), row = row_position(raster_, y_m);
  return col >= 0.0 && row >= 0.0 && col <= raster_.cols - 1 && row <= raster_.rows - 1;
}

bool BaseSurface::is_hole(double x_m, double y_m) const {
  if (!inside(x_m, y_m)) return false;
  const auto col = static_cast<std::size_t>(std::lround(column_position(raster_, x_m)));
  const auto row = static_cast<std::size_t>(std::lround(row_position(raster_, y_m)));
  return hole_[row * raster_.cols + col];
}

double BaseSurface::outside_m(double x_m, double y_m) const {
  const MapWindow extent = raster_.extent();
  return std::hypot(std::max({extent.west_m - x_m, x_m - extent.east_m, 0.0}),
                    std::max({extent.south_m - y_m, y_m - extent.north_m, 0.0}));
}

void fill_holes(DemRaster& raster) {
  const std::vector<bool> hole = holes_of(raster);
  if (std::find(hole.begin(), hole.end(), true) == hole.end()) return;
  if (raster.rows <= 1 && raster.cols <= 1) throw Error("the DEM holds no height at all");
  DemRaster coarse = halved(raster);
  fill_holes(coarse);
  for (int row = 0; row < raster.rows; ++row) {
    for (int col = 0; col < raster.cols; ++col) {
      if (hole[static_cast<std::size_t>(row) * raster.cols + col]) raster.at(row, col) = coarse.at(row / 2, col / 2);
    }
  }
  relax(raster, hole, 20);
}

CraterField base_craters(const ReliefLaw& law, std::uint64_t seed, double cell_m) {
  return {Random::mix(seed + 2), law.crater_density, 8.0 * cell_m, law.largest_crater_m};
}

DemRaster generate_base(const TerrainOptions& terrain, std::uint64_t seed) {
  constexpr int kMaxCells = 2048;
  DemRaster raster;
  raster.cell_m = std::max(1.0, std::ceil(terrain.size_m / kMaxCells));
  raster.rows = raster.cols = static_cast<int>(std::ceil(terrain.size_m / raster.cell_m));
  raster.west_m = -0.5 * raster.cols * raster.cell_m;
  raster.north_m = 0.5 * raster.rows * raster.cell_m;
  Patch patch(raster.centre(0, 0).x(), raster.centre(raster.rows - 1, 0).y(), raster.cell_m, raster.cols, raster.rows);
  const ReliefLaw law = relief_law(terrain);
  for (const Noise& octave : fractal_octaves(law, seed, 4.0 * raster.cell_m, law.outer_scale_m)) octave.add_to(patch);
  base_craters(law, seed, raster.cell_m).add_to(patch, raster.cell_m);
  raster.heights.resize(patch.values.size());
  for (int row = 0; row < raster.rows; ++row) {
    const double* from = patch.row(raster.rows - 1 - row);
    std::copy(from, from + raster.cols, &raster.at(row, 0));
  }
  return raster;
}

}  // namespace demslam

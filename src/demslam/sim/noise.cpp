#include "demslam/sim/noise.h"

#include <array>
#include <cmath>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/sim/vector_clones.h"

namespace demslam {
namespace {

struct Gradient {
  double x, y;
};

constexpr int kDirections = 256;

const std::array<Gradient, kDirections>& directions() {
  static const std::array<Gradient, kDirections> table = [] {
    std::array<Gradient, kDirections> result{};
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kDirections;
      result[i] = {std::sqrt(2.0) * std::cos(angle), std::sqrt(2.0) * std::sin(angle)};
    }
    return result;
  }();
  return table;
}

const Gradient& lattice_gradient(std::uint64_t seed, std::int64_t ix, std::int64_t iy) {
  const std::uint64_t word = seed + static_cast<std::uint64_t>(ix) * 0x9e3779b97f4a7c15ULL +
                             static_cast<std::uint64_t>(iy) * 0xc2b2ae3d27d4eb4fULL;
  return directions()[Random::mix(word) >> 56];
}

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }
double fade_slope(double t) { return 30.0 * t * t * (t * (t - 2.0) + 1.0); }

/// Where the columns of a patch fall on the noise lattice.
struct Columns {
  std::int64_t first = 0;    ///< lattice column of the patch's first node
  std::vector<int> cell;     ///< lattice column of each node, from `first`
  std::vector<double> t, s;  ///< position inside that column, and its fade
};

Columns columns_of(const std::vector<double>& positions) {
  Columns columns;
  columns.first = static_cast<std::int64_t>(std::floor(positions.front()));
  for (const double position : positions) {
    const double floor = std::floor(position), t = position - floor;
    columns.cell.push_back(static_cast<int>(static_cast<std::int64_t>(floor) - columns.first));
    columns.t.push_back(t);
    columns.s.push_back(fade(t));
  }
  return columns;
}

/// Along one patch row the field is linear in these per lattice column: n = lerp(slope_i t + offset_i, slope_{i+1}
/// (t-1) + offset_{i+1}).
struct RowBlend {
  std::vector<double> slope, offset;
};

void blend_row(std::uint64_t seed, std::int64_t first_x, double position_y, RowBlend& blend) {
  const double floor = std::floor(position_y), t = position_y - floor, s = fade(t);
  const auto iy = static_cast<std::int64_t>(floor);
  for (std::size_t i = 0; i < blend.slope.size(); ++i) {
    const auto ix = first_x + static_cast<std::int64_t>(i);
    const Gradient& low = lattice_gradient(seed, ix, iy);
    const Gradient& high = lattice_gradient(seed, ix, iy + 1);
    blend.slope[i] = (1.0 - s) * low.x + s * high.x;
    blend.offset[i] = (1.0 - s) * low.y * t + s * high.y * (t - 1.0);
  }
}

DEMSLAM_VECTOR_CLONES
void add_row(double* out, int count, const int* cell, const double* t, const double* s, const double* slope,
             const double* offset, double amplitude) {
  for (int i = 0; i < count; ++i) {
    const int k = cell[i];
    const double left = slope[k] * t[i] + offset[k];
    const double right = slope[k + 1] * (t[i] - 1.0) + offset[k + 1];
    out[i] += amplitude * (left + s[i] * (right - left));
  }
}

}  // namespace

void Noise::add_to(Patch& patch) const {
  if (patch.nx == 0) return;
  std::vector<double> positions(patch.nx);
  for (int ix = 0; ix < patch.nx; ++ix) positions[ix] = lattice_x(patch.x(ix));
  const Columns columns = columns_of(positions);
  RowBlend blend;
  blend.slope.resize(columns.cell.back() + 2);
  blend.offset.resize(columns.cell.back() + 2);
  for (int iy = 0; iy < patch.ny; ++iy) {
    blend_row(seed, columns.first, lattice_y(patch.y(iy)), blend);
    add_row(patch.row(iy), patch.nx, columns.cell.data(), columns.t.data(), columns.s.data(), blend.slope.data(),
            blend.offset.data(), amplitude_m);
  }
}

FieldSample Noise::sample(double x_m, double y_m) const {
  const double px = lattice_x(x_m), py = lattice_y(y_m);
  const double fx = std::floor(px), fy = std::floor(py);
  const double tx = px - fx, ty = py - fy, sx = fade(tx), sy = fade(ty);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy);
  const Gradient& g00 = lattice_gradient(seed, ix, iy);
  const Gradient& g10 = lattice_gradient(seed, ix + 1, iy);
  const Gradient& g01 = lattice_gradient(seed, ix, iy + 1);
  const Gradient& g11 = lattice_gradient(seed, ix + 1, iy + 1);
  const double n00 = g00.x * tx + g00.y * ty, n10 = g10.x * (tx - 1.0) + g10.y * ty;
  const double n01 = g01.x * tx + g01.y * (ty - 1.0), n11 = g11.x * (tx - 1.0) + g11.y * (ty - 1.0);
  const double low = n00 + sx * (n10 - n00), high = n01 + sx * (n11 - n01);
  const double low_x = g00.x + sx * (g10.x - g00.x) + fade_slope(tx) * (n10 - n00);
  const double high_x = g01.x + sx * (g11.x - g01.x) + fade_slope(tx) * (n11 - n01);
  const double low_y = g00.y + sx * (g10.y - g00.y), high_y = g01.y + sx * (g11.y - g01.y);
  const double scale = amplitude_m / wavelength_m;
  return {amplitude_m * (low + sy * (high - low)), scale * (low_x + sy * (high_x - low_x)),
          scale * (low_y + sy * (high_y - low_y) + fade_slope(ty) * (high - low))};
}

}  // namespace demslam

#include "demslam/sim/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

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

/// The gradients of the lattice nodes around a patch, in rows of `width`.
struct Lattice {
  std::int64_t first_u, first_v;
  int width, height;
  std::vector<double> x, y;
};

Lattice lattice_of(std::uint64_t seed, double low_u, double high_u, double low_v, double high_v) {
  Lattice lattice;
  lattice.first_u = static_cast<std::int64_t>(std::floor(low_u)) - 1;  // one more: sums along a row round otherwise
  lattice.first_v = static_cast<std::int64_t>(std::floor(low_v)) - 1;
  lattice.width = static_cast<int>(static_cast<std::int64_t>(std::floor(high_u)) - lattice.first_u) + 3;
  lattice.height = static_cast<int>(static_cast<std::int64_t>(std::floor(high_v)) - lattice.first_v) + 3;
  for (int iv = 0; iv < lattice.height; ++iv) {
    for (int iu = 0; iu < lattice.width; ++iu) {
      const Gradient& gradient = lattice_gradient(seed, lattice.first_u + iu, lattice.first_v + iv);
      lattice.x.push_back(gradient.x);
      lattice.y.push_back(gradient.y);
    }
  }
  return lattice;
}

/// Adds the noise along one row of a patch: from (u, v) on the lattice, (du, dv) from node to node.
DEMSLAM_VECTOR_CLONES
void add_row(double* out, int count, double u, double v, double du, double dv, const double* gx, const double* gy,
             int width, double amplitude) {
  for (int i = 0; i < count; ++i) {
    const double pu = u + i * du, pv = v + i * dv;
    const int iu = static_cast<int>(pu), iv = static_cast<int>(pv), k = iv * width + iu;
    const double tu = pu - iu, tv = pv - iv;
    const double su = tu * tu * tu * (tu * (tu * 6.0 - 15.0) + 10.0);
    const double sv = tv * tv * tv * (tv * (tv * 6.0 - 15.0) + 10.0);
    const double n00 = gx[k] * tu + gy[k] * tv;
    const double n10 = gx[k + 1] * (tu - 1.0) + gy[k + 1] * tv;
    const double n01 = gx[k + width] * tu + gy[k + width] * (tv - 1.0);
    const double n11 = gx[k + width + 1] * (tu - 1.0) + gy[k + width + 1] * (tv - 1.0);
    const double low = n00 + su * (n10 - n00), high = n01 + su * (n11 - n01);
    out[i] += amplitude * (low + sv * (high - low));
  }
}

/// A fraction of one from sixteen bits of a word.
double fraction(std::uint64_t word, int shift) { return static_cast<double>((word >> shift) & 0xffff) * 0x1.0p-16; }

}  // namespace

Noise::Noise(std::uint64_t seed, double wavelength_m, double amplitude_m)
    : seed_(seed),
      wavelength_m_(wavelength_m),
      amplitude_m_(amplitude_m),
      shift_u_(fraction(seed, 0)),
      shift_v_(fraction(seed, 16)) {
  const double angle = (0.2 + 0.6 * fraction(seed, 32)) * std::numbers::pi / 2.0;  // never along the map's axes
  cos_ = std::cos(angle) / wavelength_m;
  sin_ = std::sin(angle) / wavelength_m;
}

void Noise::add_points(Patch& patch) const {
  for (int iy = 0; iy < patch.ny; ++iy) {
    for (int ix = 0; ix < patch.nx; ++ix) patch.row(iy)[ix] += sample(patch.x(ix), patch.y(iy)).value;
  }
}

void Noise::add_to(Patch& patch) const {
  constexpr int kFewNodes = 64, kTile = 32;
  if (patch.nx * patch.ny <= kFewNodes) return add_points(patch);
  const int width = std::max(kTile, patch.ny);  // a strip is done in tiles: the lattice around a turned strip is large
  for (int first = 0; first < patch.nx; first += width) add_tile(patch, first, std::min(width, patch.nx - first));
}

void Noise::add_tile(Patch& patch, int first, int width) const {
  const double west = patch.x(first), east = patch.x(first + width - 1), south = patch.y0,
               north = patch.y(patch.ny - 1);
  // The angle lies in the first quadrant: u grows to the North-East, v to the North-West.
  const Lattice lattice =
      lattice_of(seed_, lattice_u(west, south), lattice_u(east, north), lattice_v(east, south), lattice_v(west, north));
  for (int iy = 0; iy < patch.ny; ++iy) {
    const double y = patch.y(iy);
    add_row(patch.row(iy) + first, width, lattice_u(west, y) - static_cast<double>(lattice.first_u),
            lattice_v(west, y) - static_cast<double>(lattice.first_v), cos_ * patch.step, -sin_ * patch.step,
            lattice.x.data(), lattice.y.data(), lattice.width, amplitude_m_);
  }
}

FieldSample Noise::sample(double x_m, double y_m) const {
  const double px = lattice_u(x_m, y_m), py = lattice_v(x_m, y_m);
  const double fx = std::floor(px), fy = std::floor(py);
  const double tx = px - fx, ty = py - fy, sx = fade(tx), sy = fade(ty);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy);
  const Gradient& g00 = lattice_gradient(seed_, ix, iy);
  const Gradient& g10 = lattice_gradient(seed_, ix + 1, iy);
  const Gradient& g01 = lattice_gradient(seed_, ix, iy + 1);
  const Gradient& g11 = lattice_gradient(seed_, ix + 1, iy + 1);
  const double n00 = g00.x * tx + g00.y * ty, n10 = g10.x * (tx - 1.0) + g10.y * ty;
  const double n01 = g01.x * tx + g01.y * (ty - 1.0), n11 = g11.x * (tx - 1.0) + g11.y * (ty - 1.0);
  const double low = n00 + sx * (n10 - n00), high = n01 + sx * (n11 - n01);
  const double low_x = g00.x + sx * (g10.x - g00.x) + fade_slope(tx) * (n10 - n00);
  const double high_x = g01.x + sx * (g11.x - g01.x) + fade_slope(tx) * (n11 - n01);
  const double low_y = g00.y + sx * (g10.y - g00.y), high_y = g01.y + sx * (g11.y - g01.y);
  const double along_u = low_x + sy * (high_x - low_x);
  const double along_v = low_y + sy * (high_y - low_y) + fade_slope(ty) * (high - low);
  return {amplitude_m_ * (low + sy * (high - low)), amplitude_m_ * (along_u * cos_ - along_v * sin_),
          amplitude_m_ * (along_u * sin_ + along_v * cos_)};
}

}  // namespace demslam

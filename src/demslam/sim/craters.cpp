#include "demslam/sim/craters.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr double kEquilibrium = 0.079;  // Trask (1966): N(>D) = 10^-1.1 D^-2, metres
constexpr double kCellsPerDiameter = 4.0;

/// C1 bump: 1 at 0, 0 from |t| = 1 on.
double bump(double t) {
  const double u = 1.0 - t * t;
  return u > 0.0 ? u * u : 0.0;
}

/// Craters of one octave of diameters, on a grid of cells of their own.
struct SizeClass {
  std::uint64_t seed;
  double low_m, high_m, density, youngest, oldest;

  double cell_m() const { return kCellsPerDiameter * high_m; }
  double mean_per_cell() const {
    return density * kEquilibrium * (1.0 / (low_m * low_m) - 1.0 / (high_m * high_m)) * cell_m() * cell_m();
  }
};

int poisson(Random& random, double mean) {
  const double limit = std::exp(-mean);
  double product = random.uniform();
  int count = 0;
  for (; product > limit; ++count) product *= random.uniform();
  return count;
}

Crater draw(Random& random, const SizeClass& size, std::int64_t ix, std::int64_t iy) {
  const double x = (static_cast<double>(ix) + random.uniform()) * size.cell_m();
  const double y = (static_cast<double>(iy) + random.uniform()) * size.cell_m();
  const double low2 = 1.0 / (size.low_m * size.low_m), high2 = 1.0 / (size.high_m * size.high_m);
  const double diameter = 1.0 / std::sqrt(low2 - random.uniform() * (low2 - high2));
  return aged_crater(x, y, diameter, random.uniform(size.youngest, size.oldest));
}

struct Rectangle {
  double west, south, east, north;
};

void collect(const SizeClass& size, const Rectangle& region, std::vector<Crater>& craters) {
  const double cell = size.cell_m(), reach = size.high_m;
  const auto first_x = static_cast<std::int64_t>(std::floor((region.west - reach) / cell));
  const auto last_x = static_cast<std::int64_t>(std::floor((region.east + reach) / cell));
  const auto first_y = static_cast<std::int64_t>(std::floor((region.south - reach) / cell));
  const auto last_y = static_cast<std::int64_t>(std::floor((region.north + reach) / cell));
  for (std::int64_t iy = first_y; iy <= last_y; ++iy) {
    for (std::int64_t ix = first_x; ix <= last_x; ++ix) {
      Random random(Random::mix(size.seed + static_cast<std::uint64_t>(ix)), static_cast<std::uint64_t>(iy));
      for (int left = poisson(random, size.mean_per_cell()); left > 0; --left) {
        const Crater crater = draw(random, size, ix, iy);
        const double r = crater.reach_m();
        if (crater.x_m + r <= region.west || crater.x_m - r >= region.east) continue;
        if (crater.y_m + r <= region.south || crater.y_m - r >= region.north) continue;
        craters.push_back(crater);
      }
    }
  }
}

/// Range of nodes of an axis that lie within centre +- reach.
std::pair<int, int> span(double origin, double step, int count, double centre, double reach) {
  const double first = std::ceil((centre - reach - origin) / step), last = std::floor((centre + reach - origin) / step);
  return {static_cast<int>(std::clamp(first, 0.0, count * 1.0)), static_cast<int>(std::clamp(last, -1.0, count - 1.0))};
}

}  // namespace

void dig(Patch& patch, const Crater& crater, double weight) {
  const auto [first_x, last_x] = span(patch.x0, patch.step, patch.nx, crater.x_m, crater.reach_m());
  const auto [first_y, last_y] = span(patch.y0, patch.step, patch.ny, crater.y_m, crater.reach_m());
  for (int iy = first_y; iy <= last_y; ++iy) {
    const double dy = patch.y(iy) - crater.y_m;
    double* row = patch.row(iy);
    for (int ix = first_x; ix <= last_x; ++ix) {
      const double dx = patch.x(ix) - crater.x_m;
      row[ix] += weight * crater.profile_m(std::sqrt(dx * dx + dy * dy));
    }
  }
}

Crater aged_crater(double x_m, double y_m, double diameter_m, double age) {
  return {x_m, y_m, diameter_m, 0.13 * std::exp(-age) * diameter_m, 0.04 * std::exp(-1.5 * age) * diameter_m};
}

double Crater::profile_m(double distance_m) const {
  const double r = 2.0 * distance_m / diameter_m;
  if (r >= 2.0) return 0.0;
  const double bowl = -depth_m * bump(r);
  return bowl + rim_m * (r < 1.0 ? bump((1.0 - r) / 0.5) : bump(r - 1.0));
}

std::vector<Crater> CraterField::within(double west, double south, double east, double north,
                                        double min_diameter_m) const {
  std::vector<Crater> craters;
  if (density <= 0.0) return craters;
  std::uint64_t octave = 0;
  for (double low = smallest_m; low < largest_m; low *= 2.0, ++octave) {
    const SizeClass size{Random::mix(seed + octave), low, std::min(2.0 * low, largest_m), density, youngest, oldest};
    if (size.high_m > min_diameter_m) collect(size, {west, south, east, north}, craters);
  }
  std::erase_if(craters, [&](const Crater& crater) { return crater.diameter_m < min_diameter_m; });
  return craters;
}

void CraterField::add_to(Patch& patch, double resolution_m) const {
  if (patch.nx == 0 || patch.ny == 0) return;
  const double smallest = 3.0 * resolution_m;
  for (const Crater& crater : within(patch.x0, patch.y0, patch.x(patch.nx - 1), patch.y(patch.ny - 1), smallest)) {
    dig(patch, crater, smooth_step(smallest, 2.0 * smallest, crater.diameter_m));
  }
}

}  // namespace demslam

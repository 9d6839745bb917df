#include "demslam/sim/terrain.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr double kFinestWavelength = 0.01;  // first octave of add_fractal
constexpr double kLatticePerStep = 2.0;     // a grid of step c holds noise of lattice spacing 2 c and longer

DemRaster base_raster(const TerrainOptions& options, std::uint64_t seed) {
  return options.dem.empty() ? generate_base(options, seed) : read_dem(options.dem);
}

/// Base rasters hold relief down to four cells and craters down to eight; the fine relief goes on from there.
double longest_fine_wavelength(const BaseSurface& base) { return 4.0 * base.cell_m(); }
double largest_fine_crater(const BaseSurface& base) { return 8.0 * base.cell_m(); }

}  // namespace

Terrain::Terrain(const TerrainOptions& options, std::uint64_t seed)
    : law_(relief_law(options)), seed_(Random::mix(seed)), base_(base_raster(options, seed_)),
      craters_{Random::mix(seed_ + 1), law_.crater_density, 0.25, std::max(0.5, largest_fine_crater(base_))} {}

void Terrain::fill(Patch& patch) const {
  std::fill(patch.values.begin(), patch.values.end(), 0.0);
  base_.add_to(patch);
  add_fractal(patch, law_, seed_, kLatticePerStep * patch.step, longest_fine_wavelength(base_));
  craters_.add_to(patch, patch.step);
}

double Terrain::height(double x_m, double y_m) const {
  Patch point(x_m, y_m, kFinestStep, 1, 1);
  fill(point);
  return point.values.front();
}

FieldSample Terrain::micro_relief(double x_m, double y_m, double step_m, double shortest_m) const {
  FieldSample sum;
  const double longest = kLatticePerStep * step_m * 0.999;
  std::uint64_t octave = 0;
  for (double wavelength = kFinestWavelength; wavelength < longest; wavelength *= 2.0, ++octave) {
    if (wavelength < shortest_m) continue;
    const double weight = smooth_step(shortest_m, 2.0 * shortest_m, wavelength);
    const double amplitude = weight * law_.amplitude_m(wavelength) / kNoiseRms;
    const FieldSample sample = Noise{Random::mix(seed_ + octave), wavelength, amplitude}.sample(x_m, y_m);
    sum.value += sample.value;
    sum.dx += sample.dx;
    sum.dy += sample.dy;
  }
  return sum;
}

void Terrain::fill_albedo(Patch& patch) const {
  std::fill(patch.values.begin(), patch.values.end(), 1.0);
  for (const double wavelength : {0.07, 0.9, 13.0, 170.0}) {
    if (wavelength < kLatticePerStep * patch.step) continue;
    Noise{Random::mix(seed_ ^ static_cast<std::uint64_t>(1000.0 * wavelength)), wavelength, 0.04 / kNoiseRms}.add_to(patch);
  }
}

}  // namespace demslam

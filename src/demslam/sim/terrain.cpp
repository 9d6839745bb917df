#include "demslam/sim/terrain.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

// Base rasters hold noise down to four cells and craters down to eight; the fine relief goes on from there.
constexpr double kLatticePerStep = 2.0;  // a grid of step c holds noise of lattice spacing 2 c and longer

DemRaster base_raster(const TerrainOptions& options, std::uint64_t seed) {
  return options.dem.empty() ? generate_base(options, seed) : read_dem(options.dem);
}

std::vector<Noise> albedo_octaves(double variation, std::uint64_t seed) {
  std::vector<Noise> octaves;
  for (const double wavelength : {0.07, 0.9, 13.0, 170.0}) {
    octaves.push_back({Random::mix(seed + octaves.size()), wavelength, variation / kNoiseRms});
  }
  return octaves;
}

}  // namespace

Terrain::Terrain(const TerrainOptions& options, std::uint64_t seed)
    : Terrain(options, seed, base_raster(options, Random::mix(seed))) {}

Terrain::Terrain(const TerrainOptions& options, std::uint64_t seed, DemRaster base)
    : law_(relief_law(options)),
      seed_(Random::mix(seed)),
      base_(std::move(base)),
      fine_(fractal_octaves(law_, seed_, 0.0, 4.0 * base_.cell_m())),
      albedo_(albedo_octaves(options.albedo_variation, Random::mix(seed_ + 3))),
      craters_{Random::mix(seed_ + 1), law_.crater_density, 0.25, 8.0 * base_.cell_m()},
      base_craters_(base_craters(law_, seed_, options.dem.empty() ? base_.cell_m() : law_.largest_crater_m)) {}

void Terrain::fill(Patch& patch) const {
  std::fill(patch.values.begin(), patch.values.end(), 0.0);
  base_.add_to(patch);
  for (const Noise& octave : fine_) {
    if (octave.wavelength_m >= kLatticePerStep * patch.step) octave.add_to(patch);
  }
  craters_.add_to(patch, patch.step);
}

std::vector<Crater> Terrain::craters(const Eigen::Vector2d& centre, double reach_m, double min_diameter_m) const {
  std::vector<Crater> all;
  for (const CraterField* field : {&craters_, &base_craters_}) {
    const std::vector<Crater> some = field->within(centre.x() - reach_m, centre.y() - reach_m, centre.x() + reach_m,
                                                   centre.y() + reach_m, min_diameter_m);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

double Terrain::height(double x_m, double y_m) const {
  Patch point(x_m, y_m, kFinestStep, 1, 1);
  fill(point);
  return point.values.front();
}

void Terrain::micro_relief(const double* x_m, const double* y_m, const float* step_m, const float* shortest_m,
                           float* slope_x, float* slope_y) const {
  std::fill_n(slope_x, kPacket, 0.0F);
  std::fill_n(slope_y, kPacket, 0.0F);
  const auto limit = static_cast<float>(kLatticePerStep) * *std::max_element(step_m, step_m + kPacket);
  const float shortest = *std::min_element(shortest_m, shortest_m + kPacket);
  for (const Noise& octave : fine_) {
    const auto wavelength = static_cast<float>(octave.wavelength_m);
    if (wavelength >= limit) break;
    if (wavelength <= shortest) continue;
    float weight[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      const float t = std::clamp(wavelength / shortest_m[i] - 1.0F, 0.0F, 1.0F);
      weight[i] = wavelength < static_cast<float>(kLatticePerStep) * step_m[i] ? t * t * (3.0F - 2.0F * t) : 0.0F;
    }
    add_noise_slopes(octave.lattice(), x_m, y_m, weight, slope_x, slope_y);
  }
}

void Terrain::fill_albedo(Patch& patch) const {
  std::fill(patch.values.begin(), patch.values.end(), 1.0);
  for (const Noise& octave : albedo_) {
    if (octave.wavelength_m >= kLatticePerStep * patch.step) octave.add_to(patch);
  }
}

}  // namespace demslam

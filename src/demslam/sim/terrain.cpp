#include "demslam/sim/terrain.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

// Base rasters hold noise down to four cells and craters down to eight; the fine relief goes on from there.
constexpr double kLatticePerStep = 2.0;  // a grid of step c holds noise of lattice spacing 2 c and longer
constexpr double kFreshDensity = 0.02;   // part of the equilibrium population that is fresh
constexpr double kSmallestFresh = 2.0, kLargestFresh = 40.0;
constexpr double kRayAlbedo = 0.12, kRayRadii = 3.0;  // fresh ejecta are brighter by this, out to there
constexpr double kLongestHill = 20000.0;
constexpr double kHorizonFadeIn = 1500.0;  // metres beyond the base's edge over which the hills rise

ReliefLaw law_of(const TerrainOptions& options, const DemRaster& base) {
  const bool measured = !options.dem.empty() && options.continue_dem;
  return measured ? continued_law(options, base) : relief_law(options);
}

DemRaster base_raster(const TerrainOptions& options, std::uint64_t seed) {
  return options.dem.empty() ? generate_base(options, seed) : read_dem(options.dem);
}

std::vector<Noise> albedo_octaves(double variation, std::uint64_t seed) {
  std::vector<Noise> octaves;
  for (const double wavelength : {0.07, 0.9, 13.0, 170.0}) {
    octaves.emplace_back(Random::mix(seed + octaves.size()), wavelength, variation / kNoiseRms);
  }
  return octaves;
}

/// Octaves longer than the base's own. Their amplitude grows as the square root of the wavelength: mountains are not
/// self-similar hummocks.
std::vector<Noise> hill_octaves(const ReliefLaw& law, std::uint64_t seed) {
  std::vector<Noise> octaves;
  const double longest_of_base = law.outer_scale_m;
  for (double wavelength = 2.0 * longest_of_base; wavelength < kLongestHill; wavelength *= 2.0) {
    const double rms = law.amplitude_m(longest_of_base) * std::sqrt(wavelength / longest_of_base);
    octaves.emplace_back(Random::mix(seed + octaves.size()), wavelength, rms / kNoiseRms);
  }
  return octaves;
}

CraterField fresh_craters(const TerrainOptions& options, const ReliefLaw& law, std::uint64_t seed, double cell_m) {
  const double largest = options.dem.empty() ? std::min(kLargestFresh, law.largest_crater_m) : 8.0 * cell_m;
  return {seed, kFreshDensity * law.crater_density, kSmallestFresh, largest, 0.0, 0.2};
}

std::vector<Crater> placed_craters(const TerrainOptions& options) {
  std::vector<Crater> craters;
  for (const Eigen::Vector3d& c : options.placed_craters) craters.push_back(aged_crater(c.x(), c.y(), c.z(), 0.0));
  return craters;
}

void brighten(Patch& patch, const Crater& crater) {
  const double radius = 0.5 * crater.diameter_m, reach = kRayRadii * radius;
  const NodeSpan columns = nodes_between(patch.x0, patch.step, patch.nx, crater.x_m - reach, crater.x_m + reach);
  const NodeSpan rows = nodes_between(patch.y0, patch.step, patch.ny, crater.y_m - reach, crater.y_m + reach);
  for (int iy = rows.first; iy <= rows.last; ++iy) {
    for (int ix = columns.first; ix <= columns.last; ++ix) {
      const double radii = std::hypot(patch.x(ix) - crater.x_m, patch.y(iy) - crater.y_m) / radius;
      patch.row(iy)[ix] += kRayAlbedo * (1.0 - smooth_step(0.8, kRayRadii, radii));
    }
  }
}

}  // namespace

Terrain::Terrain(const TerrainOptions& options, std::uint64_t seed)
    : Terrain(options, seed, base_raster(options, Random::mix(seed))) {}

Terrain::Terrain(const TerrainOptions& options, std::uint64_t seed, DemRaster base)
    : law_(law_of(options, base)),
      seed_(Random::mix(seed)),
      base_(std::move(base)),
      fine_(fractal_octaves(law_, seed_, 0.0, 4.0 * base_.cell_m())),
      hills_(hill_octaves(law_, Random::mix(seed_ + 4))),
      albedo_(albedo_octaves(options.albedo_variation, Random::mix(seed_ + 3))),
      craters_{Random::mix(seed_ + 1), law_.crater_density, 0.25, 8.0 * base_.cell_m()},
      base_craters_(base_craters(law_, seed_, options.dem.empty() ? base_.cell_m() : law_.largest_crater_m)),
      fresh_(fresh_craters(options, law_, Random::mix(seed_ + 5), base_.cell_m())),
      placed_(placed_craters(options)),
      rocks_(options, seed_, fresh_) {}

void Terrain::fill(Patch& patch) const {
  fill_ground(patch);
  if (patch.step > GroundLayer::kFinest) return;
  for (const auto& layer : layers_) layer->add_to(patch);
}

void Terrain::fill_ground(Patch& patch) const {
  std::fill(patch.values.begin(), patch.values.end(), 0.0);
  base_.add_to(patch);
  for (const Noise& octave : fine_) {
    if (octave.wavelength_m() >= kLatticePerStep * patch.step) octave.add_to(patch);
  }
  craters_.add_to(patch, patch.step);
  fresh_.add_to(patch, patch.step);
  for (const Crater& crater : placed_) dig(patch, crater);
  add_horizon(patch);
}

/// Beyond its edge the base is mirrored; hills of longer waves rise there, so that the horizon does not repeat.
void Terrain::add_horizon(Patch& patch) const {
  const auto inside = [&](int ix, int iy) { return base_.outside_m(patch.x(ix), patch.y(iy)) <= 0.0; };
  if (hills_.empty() || (inside(0, 0) && inside(patch.nx - 1, patch.ny - 1))) return;  // corners of a rectangle
  Patch hills(patch.x0, patch.y0, patch.step, patch.nx, patch.ny);
  for (const Noise& octave : hills_) {
    if (octave.wavelength_m() >= kLatticePerStep * patch.step) octave.add_to(hills);
  }
  for (int iy = 0; iy < patch.ny; ++iy) {
    for (int ix = 0; ix < patch.nx; ++ix) {
      const double outside = base_.outside_m(patch.x(ix), patch.y(iy));
      patch.row(iy)[ix] += smooth_step(0.0, kHorizonFadeIn, outside) * hills.at(ix, iy);
    }
  }
}

std::vector<Crater> Terrain::craters(const Eigen::Vector2d& centre, double reach_m, double min_diameter_m) const {
  std::vector<Crater> all = placed_;
  for (const CraterField* field : {&craters_, &base_craters_, &fresh_}) {
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

double Terrain::ground_height(double x_m, double y_m) const {
  Patch point(x_m, y_m, kFinestStep, 1, 1);
  fill_ground(point);
  return point.values.front();
}

void Terrain::micro_relief(const double* x_m, const double* y_m, const float* step_m, const float* shortest_m,
                           float* slope_x, float* slope_y) const {
  std::fill_n(slope_x, kPacket, 0.0F);
  std::fill_n(slope_y, kPacket, 0.0F);
  const auto limit = static_cast<float>(kLatticePerStep) * *std::max_element(step_m, step_m + kPacket);
  const float shortest = *std::min_element(shortest_m, shortest_m + kPacket);
  for (const Noise& octave : fine_) {
    const auto wavelength = static_cast<float>(octave.wavelength_m());
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
    if (octave.wavelength_m() >= kLatticePerStep * patch.step) octave.add_to(patch);
  }
  const double reach = 0.5 * kRayRadii * fresh_.largest_m;
  for (const Crater& crater : fresh_.within(patch.x0 - reach, patch.y0 - reach, patch.x(patch.nx - 1) + reach,
                                            patch.y(patch.ny - 1) + reach, 3.0 * patch.step)) {
    brighten(patch, crater);
  }
}

std::uint64_t Terrain::revision() const {
  std::uint64_t sum = 0;
  for (const auto& layer : layers_) sum += layer->revision();
  return sum;
}

}  // namespace demslam

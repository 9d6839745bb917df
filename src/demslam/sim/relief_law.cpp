#include "demslam/sim/relief_law.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

struct Preset {
  double amplitude_1m, outer_scale_m, crater_density, largest_crater_of_size;
};

Preset preset_of(Relief relief) {
  switch (relief) {
    case Relief::flat:
      return {0.006, 8.0, 0.3, 0.01};
    case Relief::mare:
      return {0.009, 100.0, 0.6, 0.1};
    case Relief::mid:
      return {0.011, 300.0, 1.0, 0.2};
    case Relief::highland:
      break;
  }
  return {0.013, 800.0, 1.0, 0.3};
}

constexpr std::array kLags{4, 8, 16, 32};  // cells

/// Variance of the second difference over a lag of L wavelengths of one octave of unit RMS.
double octave_second_difference(double lag) {
  constexpr int kPoints = 400;
  const Noise noise(1, 1.0, 1.0 / kNoiseRms);
  Random random(2);
  double sum = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double x = random.uniform(0.0, 1000.0), y = random.uniform(0.0, 1000.0);
    const double second =
        noise.sample(x - lag, y).value - 2.0 * noise.sample(x, y).value + noise.sample(x + lag, y).value;
    sum += second * second;
  }
  return sum / kPoints;
}

/// Second difference over 1 m of the whole fractal with amplitude_1m = 1 and this exponent.
double second_difference_of_law(double hurst) {
  double sum = 0.0;
  for (int k = -8; k <= 8; ++k) {
    const double wavelength = std::pow(2.0, k);
    sum += std::pow(wavelength, 2.0 * hurst) * octave_second_difference(1.0 / wavelength);
  }
  return std::sqrt(sum);
}

/// Least-squares line through (log lag, log second difference): the exponent, and the value at 1 m.
struct PowerLaw {
  double exponent = 0.0, at_1m = 0.0;
  int points = 0;
};

PowerLaw fitted(const DemRaster& dem) {
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const int lag : kLags) {
    const double value = second_difference_m(dem, lag);
    if (value <= 0.0) continue;
    const double x = std::log(lag * dem.cell_m), y = std::log(value);
    n += 1.0, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  if (n < 3.0) return {};
  PowerLaw law;
  law.points = static_cast<int>(n);
  law.exponent = std::clamp((n * sxy - sx * sy) / (n * sxx - sx * sx), 0.6, 1.0);
  law.at_1m = std::exp((sy - law.exponent * sx) / n);
  return law;
}

}  // namespace

double ReliefLaw::amplitude_m(double wavelength_m) const { return amplitude_1m * std::pow(wavelength_m, hurst); }

ReliefLaw relief_law(const TerrainOptions& terrain) {
  const Preset preset = preset_of(terrain.relief);
  ReliefLaw law;
  law.amplitude_1m = preset.amplitude_1m * terrain.roughness;
  law.hurst = terrain.hurst;
  law.outer_scale_m = preset.outer_scale_m;
  law.crater_density = preset.crater_density * terrain.crater_density;
  law.largest_crater_m = std::max(1.0, preset.largest_crater_of_size * terrain.size_m);
  return law;
}

ReliefLaw continued_law(const TerrainOptions& terrain, const DemRaster& dem) {
  ReliefLaw law = relief_law(terrain);
  const PowerLaw measured = fitted(dem);
  if (measured.points == 0) return law;
  law.hurst = measured.exponent;
  law.amplitude_1m = terrain.roughness * measured.at_1m / second_difference_of_law(law.hurst);
  return law;
}

double second_difference_m(const DemRaster& dem, int lag_cells) {
  std::vector<float> seconds;
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(dem.rows) * dem.cols / 1e5)));
  for (int row = lag_cells; row < dem.rows - lag_cells; row += stride) {
    for (int col = lag_cells; col < dem.cols - lag_cells; col += stride) {
      const float middle = 2.0F * dem.at(row, col);
      for (const float sum : {dem.at(row, col - lag_cells) + dem.at(row, col + lag_cells),
                              dem.at(row - lag_cells, col) + dem.at(row + lag_cells, col)}) {
        if (std::isfinite(sum - middle)) seconds.push_back(std::abs(sum - middle));
      }
    }
  }
  if (seconds.size() < 100) return 0.0;
  const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return 1.4826 * *middle;
}

std::vector<Noise> fractal_octaves(const ReliefLaw& law, std::uint64_t seed, double shortest_m, double longest_m) {
  std::vector<Noise> octaves;
  std::uint64_t k = 0;
  for (double wavelength = 0.01; wavelength < longest_m; wavelength *= 2.0, ++k) {
    if (wavelength < shortest_m) continue;
    octaves.emplace_back(Random::mix(seed + k), wavelength, law.amplitude_m(wavelength) / kNoiseRms);
  }
  return octaves;
}

}  // namespace demslam

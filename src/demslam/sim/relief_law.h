#pragma once

#include <cstdint>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/sim/noise.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// The fractal and crater law of a relief, shared by the generated base and the fine relief below any base.
struct ReliefLaw {
  double amplitude_1m = 0.0;     ///< RMS of the octave of 1 m wavelength, metres
  double hurst = 0.9;            ///< RMS of wavelength L: amplitude_1m L^hurst
  double outer_scale_m = 100.0;  ///< longest wavelength
  double crater_density = 1.0;
  double largest_crater_m = 100.0;

  double amplitude_m(double wavelength_m) const;
};

/// The law of the scene's relief preset, for a generated base.
ReliefLaw relief_law(const TerrainOptions& terrain);

/// The scene's law with amplitude and exponent as measured on a DEM, so that the fine relief goes on where the DEM's
/// own spectrum ends. Measured are typical (median) second differences of the heights over 4 to 32 cells; an exponent
/// outside 0.6 to 1 is clamped. The scene's law where the DEM has too few heights. Times `roughness`.
ReliefLaw continued_law(const TerrainOptions& terrain, const DemRaster& dem);

/// Typical |z(p - L) - 2 z(p) + z(p + L)| of a raster over a lag of cells, as the standard deviation of a Gaussian:
/// 1.4826 times the median. 0 when fewer than 100 triples have heights.
double second_difference_m(const DemRaster& dem, int lag_cells);

/// Octaves of noise with wavelengths 0.01 m * 2^k in [shortest, longest), shortest first, one seed for each k.
std::vector<Noise> fractal_octaves(const ReliefLaw& law, std::uint64_t seed, double shortest_m, double longest_m);

}  // namespace demslam

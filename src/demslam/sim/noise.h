#pragma once

#include <cstdint>

#include "demslam/sim/patch.h"
#include "demslam/sim/shading_kernels.h"

namespace demslam {

/// Gradient noise (Perlin 2002, quintic fade, C2) of one wavelength: a smooth random field that depends on nothing but
/// the seed and the map position. Zero mean; kNoiseRms is its standard deviation at amplitude 1. No Eigen here: the
/// kernels are compiled for several instruction sets.
struct Noise {
  std::uint64_t seed = 0;
  double wavelength_m = 1.0;
  double amplitude_m = 1.0;

  void add_to(Patch& patch) const;
  /// The same field at one point, with its gradient.
  FieldSample sample(double x_m, double y_m) const;
  /// For the kernel that samples many points at once.
  NoiseLattice lattice() const { return {seed, 1.0 / wavelength_m, 0.0, lattice_x(0.0), lattice_y(0.0), amplitude_m}; }

 private:
  /// Position on the noise lattice, shifted by the seed: octaves must not share their zeros.
  double lattice_x(double x_m) const { return x_m / wavelength_m + static_cast<double>(seed & 0xffff) * 0x1.0p-16; }
  double lattice_y(double y_m) const {
    return y_m / wavelength_m + static_cast<double>((seed >> 16) & 0xffff) * 0x1.0p-16;
  }
};

inline constexpr double kNoiseRms = 0.305;

}  // namespace demslam

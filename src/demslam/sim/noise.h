#pragma once

#include <cstdint>

#include "demslam/sim/patch.h"
#include "demslam/sim/shading_kernels.h"

namespace demslam {

/// Gradient noise (Perlin 2002, quintic fade, C2) of one wavelength: a smooth random field that depends on nothing but
/// the seed and the map position. Zero mean; kNoiseRms is its standard deviation at amplitude 1. The lattice is turned
/// by an angle of the seed's, so that octaves share neither their axes nor the map's. No Eigen here: the kernels are
/// compiled for several instruction sets.
class Noise {
 public:
  Noise(std::uint64_t seed, double wavelength_m, double amplitude_m);

  double wavelength_m() const { return wavelength_m_; }
  double amplitude_m() const { return amplitude_m_; }

  void add_to(Patch& patch) const;
  /// The same field at one point, with its gradient.
  FieldSample sample(double x_m, double y_m) const;
  /// For the kernel that samples many points at once.
  NoiseLattice lattice() const { return {seed_, cos_, sin_, shift_u_, shift_v_, amplitude_m_}; }

 private:
  /// Position on the noise lattice, shifted by the seed: octaves must not share their zeros.
  double lattice_u(double x_m, double y_m) const { return cos_ * x_m + sin_ * y_m + shift_u_; }
  double lattice_v(double x_m, double y_m) const { return cos_ * y_m - sin_ * x_m + shift_v_; }
  void add_points(Patch& patch) const;
  void add_tile(Patch& patch, int first, int width) const;  ///< the columns [first, first + width)

  std::uint64_t seed_;
  double wavelength_m_, amplitude_m_;
  double cos_, sin_;  ///< of the lattice's angle, per wavelength
  double shift_u_, shift_v_;
};

inline constexpr double kNoiseRms = 0.305;

}  // namespace demslam

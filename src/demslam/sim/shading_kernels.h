#pragma once

#include <cstdint>

#include "demslam/sim/ray_packet.h"

namespace demslam {

/// One octave of gradient noise, as the kernel needs it: lattice position u = along x + across y + shift_u,
/// v = along y - across x + shift_v.
struct NoiseLattice {
  std::uint64_t seed;
  double along, across, shift_u, shift_v;
  double amplitude_m;
};

/// Adds weight * gradient of the octave at sixteen places: the packet form of Noise::sample(), in single precision.
/// No Eigen in these files: the kernels are compiled for several instruction sets, with the same result on each.
void add_noise_slopes(const NoiseLattice& lattice, const double* x_m, const double* y_m, const float* weight,
                      float* slope_x, float* slope_y);

/// The lattice's unit-RMS gradients, 256 directions.
struct GradientTable {
  float x[256], y[256];
};
const GradientTable& gradient_table();

}  // namespace demslam

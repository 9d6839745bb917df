#include "demslam/sim/shading_kernels.h"

#include <cmath>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/sim/vector_clones.h"

namespace demslam {
namespace {

/// The four corners of a lattice cell: south-west, south-east, north-west, north-east.
struct alignas(64) Corners {
  float x[4][kPacket], y[4][kPacket];
};

DEMSLAM_VECTOR_CLONES
void locate(const double* position, std::int32_t* cell, float* t) {
  for (int i = 0; i < kPacket; ++i) {
    const auto truncated = static_cast<std::int32_t>(position[i]);
    cell[i] = truncated - (position[i] < truncated ? 1 : 0);
    t[i] = static_cast<float>(position[i] - cell[i]);
  }
}

DEMSLAM_VECTOR_CLONES
void look_up(std::uint64_t seed, const std::int32_t* iu, const std::int32_t* iv, const GradientTable& table,
             Corners& corners) {
  for (int corner = 0; corner < 4; ++corner) {
    std::int32_t index[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      const auto u = static_cast<std::uint64_t>(static_cast<std::int64_t>(iu[i]) + (corner & 1));
      const auto v = static_cast<std::uint64_t>(static_cast<std::int64_t>(iv[i]) + (corner >> 1));
      index[i] =
          static_cast<std::int32_t>(Random::mix(seed + u * 0x9e3779b97f4a7c15ULL + v * 0xc2b2ae3d27d4eb4fULL) >> 56);
    }
    for (int i = 0; i < kPacket; ++i) {
      corners.x[corner][i] = table.x[index[i]];
      corners.y[corner][i] = table.y[index[i]];
    }
  }
}

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }
float fade_slope(float t) { return 30.0F * t * t * (t * (t - 2.0F) + 1.0F); }

DEMSLAM_VECTOR_CLONES
void gradients(const Corners& g, const float* tu, const float* tv, float* along_u, float* along_v) {
  for (int i = 0; i < kPacket; ++i) {
    const float u = tu[i], v = tv[i], su = fade(u), sv = fade(v);
    const float n00 = g.x[0][i] * u + g.y[0][i] * v, n10 = g.x[1][i] * (u - 1.0F) + g.y[1][i] * v;
    const float n01 = g.x[2][i] * u + g.y[2][i] * (v - 1.0F);
    const float n11 = g.x[3][i] * (u - 1.0F) + g.y[3][i] * (v - 1.0F);
    const float low = n00 + su * (n10 - n00), high = n01 + su * (n11 - n01);
    const float low_u = g.x[0][i] + su * (g.x[1][i] - g.x[0][i]) + fade_slope(u) * (n10 - n00);
    const float high_u = g.x[2][i] + su * (g.x[3][i] - g.x[2][i]) + fade_slope(u) * (n11 - n01);
    const float low_v = g.y[0][i] + su * (g.y[1][i] - g.y[0][i]), high_v = g.y[2][i] + su * (g.y[3][i] - g.y[2][i]);
    along_u[i] = low_u + sv * (high_u - low_u);
    along_v[i] = low_v + sv * (high_v - low_v) + fade_slope(v) * (high - low);
  }
}

}  // namespace

const GradientTable& gradient_table() {
  static const GradientTable table = [] {
    GradientTable result{};
    for (int i = 0; i < 256; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 256;
      result.x[i] = static_cast<float>(std::sqrt(2.0) * std::cos(angle));
      result.y[i] = static_cast<float>(std::sqrt(2.0) * std::sin(angle));
    }
    return result;
  }();
  return table;
}

void add_noise_slopes(const NoiseLattice& lattice, const double* x_m, const double* y_m, const float* weight,
                      float* slope_x, float* slope_y) {
  alignas(64) double u[kPacket], v[kPacket];
  alignas(64) std::int32_t iu[kPacket], iv[kPacket];
  alignas(64) float tu[kPacket], tv[kPacket], along_u[kPacket], along_v[kPacket];
  Corners corners;
  for (int i = 0; i < kPacket; ++i) {
    u[i] = lattice.along * x_m[i] + lattice.across * y_m[i] + lattice.shift_u;
    v[i] = lattice.along * y_m[i] - lattice.across * x_m[i] + lattice.shift_v;
  }
  locate(u, iu, tu);
  locate(v, iv, tv);
  look_up(lattice.seed, iu, iv, gradient_table(), corners);
  gradients(corners, tu, tv, along_u, along_v);
  const auto along = static_cast<float>(lattice.amplitude_m * lattice.along);
  const auto across = static_cast<float>(lattice.amplitude_m * lattice.across);
  for (int i = 0; i < kPacket; ++i) {
    slope_x[i] += weight[i] * (along * along_u[i] - across * along_v[i]);
    slope_y[i] += weight[i] * (across * along_u[i] + along * along_v[i]);
  }
}

}  // namespace demslam

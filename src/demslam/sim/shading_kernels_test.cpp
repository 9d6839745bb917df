#include "demslam/sim/shading_kernels.h"

#include <gtest/gtest.h>

#include "demslam/sim/noise.h"

namespace demslam {
namespace {

TEST(ShadingKernels, GiveTheSlopesOfTheNoiseItself) {
  const Noise noise{0x1234567890abcdefULL, 0.02, 0.01};
  double x[kPacket], y[kPacket];
  float weight[kPacket], slope_x[kPacket] = {}, slope_y[kPacket] = {};
  for (int i = 0; i < kPacket; ++i) {
    x[i] = 311.7 - 80.013 * i;
    y[i] = -0.05 + 0.0071 * i;
    weight[i] = i % 5 == 0 ? 0.0F : 0.5F;
  }
  add_noise_slopes(noise.lattice(), x, y, weight, slope_x, slope_y);
  for (int i = 0; i < kPacket; ++i) {
    const FieldSample sample = noise.sample(x[i], y[i]);
    EXPECT_NEAR(slope_x[i], weight[i] * sample.dx, 1e-4) << i;
    EXPECT_NEAR(slope_y[i], weight[i] * sample.dy, 1e-4) << i;
  }
}

}  // namespace
}  // namespace demslam

#include "demslam/sim/ray_passes.h"

#include <cstddef>
#include <utility>

namespace demslam {

std::vector<Pass> further_passes() {
  std::vector<Pass> passes;
  for (const auto& [du, dv] : {std::pair{-0.125, -0.375}, {0.125, 0.375}, {0.375, -0.125}, {-0.375, 0.125}}) {
    passes.push_back({.du = du, .dv = dv, .is_centre = false});
  }
  return passes;
}

std::vector<Pass> passes_of(int per_axis) {
  std::vector<Pass> passes;
  if (per_axis % 2 == 0) passes.push_back({.weight = 0.0F});
  const int count = per_axis * per_axis, middle = count / 2, stride = per_axis + 1;
  for (int k = 0; k < count; ++k) {
    const int moment = (((k - middle) * stride + middle) % count + count) % count;  // a permutation: stride is coprime
    const int column = k % per_axis, row = k / per_axis;
    passes.push_back({(column + 0.5) / per_axis - 0.5, (row + 0.5) / per_axis - 0.5, (moment + 0.5) / count - 0.5,
                      1.0F / static_cast<float>(count), 2 * k + 1 == count});
  }
  return passes;
}

std::vector<Pass> moments_of(int count) {
  std::vector<Pass> passes;
  passes.reserve(count);
  for (int k = 0; k < count; ++k) {
    passes.push_back(
        {.time = (k + 0.5) / count - 0.5, .weight = 1.0F / static_cast<float>(count), .is_centre = 2 * k + 1 == count});
  }
  return passes;
}

}  // namespace demslam

// Nanoseconds per linearisation of the DEM factors: build/release/bench/height_factor_bench
#include <benchmark/benchmark.h>
#include <gtsam/nonlinear/Values.h>

#include <cmath>

#include "demslam/anchoring/dem_factors.h"

namespace {

using namespace demslam;

std::shared_ptr<const Dem> rolling_ground(Interpolation interpolation) {
  DemRaster raster{.rows = 200, .cols = 200, .cell_m = 5.0, .west_m = -500.0, .north_m = 500.0};
  raster.heights.resize(40000);
  for (int row = 0; row < raster.rows; ++row) {
    for (int col = 0; col < raster.cols; ++col) {
      raster.at(row, col) = static_cast<float>(4.0 * std::sin(0.11 * row) * std::cos(0.07 * col));
    }
  }
  return std::make_shared<const Dem>(std::move(raster), interpolation);
}

template <class Factor>
void linearise(benchmark::State& state, Interpolation interpolation) {
  const auto noise = gtsam::noiseModel::Isotropic::Sigma(std::is_same_v<Factor, DemHeightFactor> ? 1 : 2, 0.5);
  const Factor factor(0, rolling_ground(interpolation), Eigen::Vector3d::Zero(), noise);
  gtsam::Values values;
  values.insert(0, gtsam::Pose3(gtsam::Rot3::RzRyRx(0.05, -0.1, 0.7), gtsam::Point3(12.3, -45.6, 1.0)));
  for (auto _ : state) benchmark::DoNotOptimize(factor.linearize(values));
}

void height_bicubic(benchmark::State& state) { linearise<DemHeightFactor>(state, Interpolation::bicubic); }
void height_bilinear(benchmark::State& state) { linearise<DemHeightFactor>(state, Interpolation::bilinear); }
void normal_bicubic(benchmark::State& state) { linearise<DemNormalFactor>(state, Interpolation::bicubic); }

BENCHMARK(height_bicubic);
BENCHMARK(height_bilinear);
BENCHMARK(normal_bicubic);

}  // namespace

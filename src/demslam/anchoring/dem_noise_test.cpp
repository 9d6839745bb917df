#include "demslam/anchoring/dem_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

constexpr int kPatches = 12;

/// Self-affine relief, as the Moon's is.
DemRaster relief() {
  DemRaster dem{.rows = 120, .cols = 120, .cell_m = 5.0, .west_m = -300.0, .north_m = 300.0};
  dem.heights.assign(14400, 0.0F);
  std::uint64_t seed = 10;
  for (double length_m = 160.0; length_m > 4.0; length_m /= 2.0) {
    const double rms_m = 8.0 * std::pow(length_m / 160.0, 0.9);
    dem = perturb(dem, {.noise_m = {.rms = rms_m, .correlation_length_m = length_m, .seed = seed++}});
  }
  return dem;
}

const Dem kGround(relief());

Dem noisy(double rms_m) {
  return Dem(perturb(relief(), {.noise_m = {.rms = rms_m, .correlation_length_m = 10.0, .seed = 3}}));
}

Pose middle_of(int patch) {
  return Pose(rotation_from_rpy(0.05, -0.1, 0.8), Eigen::Vector3d(40.0 * (patch - kPatches / 2), -20.0, 3.0));
}

/// Exact ground, 30 m square.
TerrainPatch seen_from(const Pose& T_map_body) {
  Random random(6);
  TerrainPatch patch;
  for (double x = -12.5; x < 15.0; x += 5.0) {
    for (double y = -12.5; y < 15.0; y += 5.0) {
      Eigen::Vector3d p = T_map_body.translation() + Eigen::Vector3d(x, y, 0.0);
      p.z() = *kGround.height(p.x(), p.y()) + 0.15 * random.normal();
      patch.cells.push_back({T_map_body.inverse() * p, 0.15 * 0.15, 10});
    }
  }
  return patch;
}

/// Of a DEM whose noise is said to be 0.5 m, where the rover takes itself for displaced.
double noise_scale(const Dem& dem, bool filter, const Pose& displaced = {}) {
  DemNoise noise(std::make_shared<Dem>(dem), {0.5, 10.0}, filter);
  for (int i = 0; i < kPatches; ++i) {
    const Pose T_map_body = middle_of(i);
    noise.add(seen_from(T_map_body), T_map_body * displaced);
  }
  return noise.scale();
}

/// Twelve patches tell the noise to a factor of two.
TEST(DemNoise, TellsANoisierDem) {
  for (const bool filter : {true, false}) {
    EXPECT_NEAR(std::log2(noise_scale(noisy(1.0), filter)), 1.0, 1.01) << filter;
    EXPECT_NEAR(std::log2(noise_scale(noisy(2.0), filter)), 2.0, 1.01) << filter;
    EXPECT_NEAR(std::log2(noise_scale(noisy(4.0), filter)), 3.0, 1.01) << filter;
  }
}

TEST(DemNoise, BelievesWhatWasStatedWhereItFits) {
  for (const bool filter : {true, false}) {
    EXPECT_LT(noise_scale(noisy(0.5), filter), 2.01) << filter;
    EXPECT_EQ(noise_scale(kGround, filter), 1.0) << filter;
  }
}

/// Of a DEM that was filtered too little: the level that fits is one of more noise, but not so much error.
TEST(DemNoise, ErrsLessTheLessThePatchesLeave) {
  DemNoise noise(std::make_shared<Dem>(noisy(2.0)), {0.5, 10.0}, true);
  for (int i = 0; i < kPatches; ++i) noise.add(seen_from(middle_of(i)), middle_of(i));
  ASSERT_GT(noise.scale(), 1.5);
  const DemErrorModel of_level = WienerFilter::of(noisy(2.0).raster(), {0.5 * noise.scale(), 10.0})->remaining();
  const DemErrorModel stated = WienerFilter::of(noisy(2.0).raster(), {0.5, 10.0})->remaining();
  EXPECT_LE(noise.error().sigma_m, of_level.sigma_m);
  EXPECT_GE(noise.error().sigma_m, stated.sigma_m);
  EXPECT_EQ(noise.error().correlation_length_m, of_level.correlation_length_m);
}

/// On a crest a filter that is too wide leaves little in shape and lies a metre too low.
TEST(DemNoise, DoesNotTakeACrestForNoise) {
  const auto crest_m = [](double y) { return -1.2 * std::abs(y + 20.0); };
  const auto crested = [&](const DemRaster& dem) {
    DemRaster result = dem;
    for (int row = 0; row < dem.rows; ++row) {
      for (int col = 0; col < dem.cols; ++col) {
        result.at(row, col) += static_cast<float>(crest_m(dem.north_m - (row + 0.5) * dem.cell_m));
      }
    }
    return result;
  };
  DemNoise noise(std::make_shared<Dem>(crested(noisy(0.5).raster())), {0.5, 10.0}, true);
  for (int i = 0; i < kPatches; ++i) {
    const Pose T_map_body = middle_of(i);
    TerrainPatch patch = seen_from(T_map_body);
    for (PatchCell& cell : patch.cells) {
      Eigen::Vector3d p = T_map_body * cell.p_body;
      p.z() += crest_m(p.y());
      cell.p_body = T_map_body.inverse() * p;
    }
    noise.add(patch, T_map_body);
  }
  EXPECT_LT(noise.scale(), 2.01);
}

TEST(DemNoise, SaysNothingWithoutPatches) {
  const DemNoise noise(std::make_shared<Dem>(kGround), {0.5, 10.0}, true);
  EXPECT_EQ(noise.scale(), 1.0);
}

TEST(DemNoise, IsNotMisledByTheRoversOwnError) {
  const Pose displaced(rotation_from_rpy(0.01, 0.01, 0.0), Eigen::Vector3d(1.0, -1.0, 2.0));
  for (const bool filter : {true, false}) EXPECT_LT(noise_scale(noisy(0.5), filter, displaced), 2.01) << filter;
}

}  // namespace
}  // namespace demslam

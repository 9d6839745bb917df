#include "demslam/anchoring/dem_noise.h"

#include <gtest/gtest.h>

#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

constexpr int kPatches = 12;

Dem rough(const GaussianField& noise) {
  DemRaster dem{.rows = 120, .cols = 120, .cell_m = 5.0, .west_m = -300.0, .north_m = 300.0};
  dem.heights.assign(14400, 0.0F);
  dem = perturb(dem, {.noise_m = {.rms = 4.0, .correlation_length_m = 40.0, .seed = 2}});
  return Dem(perturb(dem, {.noise_m = noise}));
}

const Dem kGround = rough({});

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

/// Of a DEM with such errors, where the rover takes itself for displaced.
double noise_scale(const Dem& dem, const Pose& displaced = {}) {
  DemNoise noise;
  for (int i = 0; i < kPatches; ++i) {
    const Pose T_map_body = middle_of(i);
    noise.add(seen_from(T_map_body), T_map_body * displaced, dem, {0.5, 10.0});
  }
  return noise.scale();
}

TEST(DemNoise, TellsANoisierDem) {
  EXPECT_NEAR(noise_scale(rough({.rms = 1.0, .correlation_length_m = 10.0, .seed = 3})), 2.0, 0.5);
  EXPECT_NEAR(noise_scale(rough({.rms = 2.0, .correlation_length_m = 10.0, .seed = 3})), 4.0, 1.0);
}

TEST(DemNoise, BelievesWhatWasStatedWhereItFits) {
  EXPECT_LT(noise_scale(rough({.rms = 0.5, .correlation_length_m = 10.0, .seed = 3})), 1.25);
  EXPECT_EQ(noise_scale(kGround), 1.0);
  EXPECT_EQ(DemNoise().scale(), 1.0);
}

TEST(DemNoise, IsNotMisledByTheRoversOwnError) {
  const Pose displaced(rotation_from_rpy(0.01, 0.01, 0.0), Eigen::Vector3d(1.0, -1.0, 2.0));
  EXPECT_LT(noise_scale(rough({.rms = 0.5, .correlation_length_m = 10.0, .seed = 3}), displaced), 1.3);
}

}  // namespace
}  // namespace demslam

#include "demslam/anchoring/believed_terrain.h"

#include <gtest/gtest.h>

#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

constexpr DemErrorModel kError{.sigma_m = 0.5, .correlation_length_m = 10.0};

/// Two kilometres square, in cells of 5 m.
std::shared_ptr<const Dem> large() {
  DemRaster dem{.rows = 400, .cols = 400, .cell_m = 5.0, .west_m = -1000.0, .north_m = 1000.0};
  dem.heights.assign(160000, 0.0F);
  return std::make_shared<Dem>(perturb(dem, {.noise_m = {.rms = 2.0, .correlation_length_m = 30.0, .seed = 2}}));
}

TEST(BelievedTerrain, IsTheWholeFilteredDemAroundTheRover) {
  const auto dem = large();
  const BelievedDem whole = most_probable(dem, kError);
  BelievedTerrain terrain(dem, kError, true, false);
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(-300.0, 100.0), Eigen::Vector2d(700.0, -700.0)}) {
    const BelievedDem& here = terrain.around(place);
    EXPECT_EQ(here.error.sigma_m, whole.error.sigma_m);
    EXPECT_LT(here.dem->raster().rows, dem->raster().rows);
    for (const double aside : {-240.0, 0.0, 240.0}) {
      EXPECT_NEAR(here.dem->height(place.x() + aside, place.y() - aside).value(),
                  whole.dem->height(place.x() + aside, place.y() - aside).value(), 1e-6);
    }
  }
}

TEST(BelievedTerrain, IsFilteredOnceWhileTheRoverStaysAround) {
  BelievedTerrain terrain(large(), kError, true, false);
  const std::shared_ptr<const Dem> first = terrain.around({0.0, 0.0}).dem;
  EXPECT_EQ(terrain.around({200.0, -200.0}).dem, first);
  EXPECT_NE(terrain.around({300.0, 0.0}).dem, first);
}

TEST(BelievedTerrain, IsTheDemAsGivenWhereThereIsNothingToFilter) {
  const auto dem = large();
  EXPECT_EQ(BelievedTerrain(dem, kError, false, false).around({0.0, 0.0}).dem, dem);
  EXPECT_EQ(BelievedTerrain(dem, kError, true, false).around({5000.0, 0.0}).dem, dem);
}

}  // namespace
}  // namespace demslam

#include "demslam/sim/terrain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/sim/clipmap.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

TerrainOptions small_highland() {
  TerrainOptions options;
  options.size_m = 200.0;
  return options;
}

TEST(Noise, HasTheStatedSpread) {
  Patch patch(0.0, 0.0, 0.37, 400, 400);
  Noise(5, 1.0, 2.0).add_to(patch);
  double sum = 0.0, squares = 0.0;
  for (const double value : patch.values) sum += value, squares += value * value;
  const double mean = sum / patch.values.size(), rms = std::sqrt(squares / patch.values.size() - mean * mean);
  EXPECT_NEAR(mean, 0.0, 0.03);
  EXPECT_NEAR(rms, 2.0 * kNoiseRms, 0.04 * 2.0 * kNoiseRms);
}

TEST(Noise, PatchAndPointAgreeAndTheGradientIsNumericallyRight) {
  const Noise noise{9, 0.7, 1.3};
  Patch patch(-3.0, 4.0, 0.111, 20, 20);
  noise.add_to(patch);
  const double h = 1e-6;
  for (int i = 0; i < 20; ++i) {
    const double x = patch.x(i), y = patch.y(19 - i);
    const FieldSample sample = noise.sample(x, y);
    EXPECT_NEAR(sample.value, patch.at(i, 19 - i), 1e-12);
    EXPECT_NEAR(sample.dx, (noise.sample(x + h, y).value - noise.sample(x - h, y).value) / (2.0 * h), 1e-6);
    EXPECT_NEAR(sample.dy, (noise.sample(x, y + h).value - noise.sample(x, y - h).value) / (2.0 * h), 1e-6);
  }
}

TEST(Noise, IsNotAlignedWithTheMap) {
  // Gradient noise is quiet along the lines of its lattice: were they the map's, every fourth row would be.
  Patch patch(0.0, 0.0, 0.25, 4000, 16);
  Noise(5, 1.0, 1.0).add_to(patch);
  double quietest = 1e9, loudest = 0.0;
  for (int iy = 0; iy < patch.ny; ++iy) {
    double squares = 0.0;
    for (int ix = 0; ix < patch.nx; ++ix) squares += patch.at(ix, iy) * patch.at(ix, iy);
    quietest = std::min(quietest, squares), loudest = std::max(loudest, squares);
  }
  EXPECT_LT(loudest / quietest, 1.25);
}

TEST(Crater, IsSmoothAndEndsAtItsReach) {
  const Crater crater{0.0, 0.0, 10.0, 2.0, 0.4};
  EXPECT_DOUBLE_EQ(crater.profile_m(0.0), -2.0);
  EXPECT_NEAR(crater.profile_m(5.0), 0.4, 1e-12);  // rim crest
  EXPECT_EQ(crater.profile_m(crater.reach_m()), 0.0);
  const double h = 1e-5;
  for (double r = h; r < 12.0; r += 0.01) {
    const double left = (crater.profile_m(r) - crater.profile_m(r - h)) / h;
    const double right = (crater.profile_m(r + h) - crater.profile_m(r)) / h;
    EXPECT_NEAR(left, right, 1e-3) << r;
  }
}

TEST(CraterField, FollowsTheEquilibriumLaw) {
  const CraterField field{3, 1.0, 0.25, 16.0};
  const double side = 300.0;
  for (const double diameter : {0.5, 1.0, 2.0}) {
    double inside = 0.0;
    for (const Crater& crater : field.within(0.0, 0.0, side, side, diameter)) {
      inside += crater.x_m > 0.0 && crater.x_m < side && crater.y_m > 0.0 && crater.y_m < side;
    }
    const double expected = 0.079 * (1.0 / (diameter * diameter) - 1.0 / 256.0) * side * side;
    EXPECT_NEAR(inside, expected, 4.0 * std::sqrt(expected)) << diameter;
  }
}

TEST(BaseSurface, PassesThroughTheCellsAndIsSmoothBetween) {
  Random random(4);
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, 20, 2.0);
  for (float& height : raster.heights) height = static_cast<float>(random.normal());
  const BaseSurface surface(raster);
  const auto height = [&](double x, double y) {
    Patch point(x, y, 1.0, 1, 1);
    surface.add_to(point);
    return point.values.front();
  };
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector2d centre = raster.centre(k, 19 - k);
    EXPECT_NEAR(height(centre.x(), centre.y()), raster.at(k, 19 - k), 1e-9);
    const double h = 1e-5;  // the slope is the same from both sides of a cell centre
    EXPECT_NEAR(height(centre.x() + h, 0.3) - height(centre.x(), 0.3),
                height(centre.x(), 0.3) - height(centre.x() - h, 0.3), 1e-8);
  }
}

TEST(BaseSurface, FillsHolesSmoothlyAndRemembersThem) {
  DemRaster raster = plane_raster(5.0, {0.1, -0.2}, 40, 1.0);
  for (int row = 15; row < 22; ++row) {
    for (int col = 10; col < 20; ++col) raster.at(row, col) = std::nanf("");
  }
  const BaseSurface surface(raster);
  EXPECT_TRUE(surface.is_hole(raster.centre(18, 14).x(), raster.centre(18, 14).y()));
  EXPECT_FALSE(surface.is_hole(raster.centre(5, 5).x(), raster.centre(5, 5).y()));
  const Eigen::Vector2d middle = raster.centre(18, 14);
  EXPECT_NEAR(surface.raster().at(18, 14), 5.0 + 0.1 * middle.x() - 0.2 * middle.y(), 0.5);
}

TEST(BaseSurface, NothingButHolesIsRefused) {
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, 4, 1.0);
  raster.heights.assign(16, std::nanf(""));
  EXPECT_THROW(BaseSurface{raster}, Error);
}

TEST(Terrain, IsTheSameHoweverItIsAskedFor) {
  const Terrain terrain(small_highland(), 7);
  Patch patch(10.0, -20.0, Terrain::kFinestStep, 60, 60);
  terrain.fill(patch);
  for (int i = 0; i < 60; i += 7) EXPECT_NEAR(terrain.height(patch.x(i), patch.y(i)), patch.at(i, i), 1e-9);
}

TEST(Terrain, DependsOnTheSeed) {
  EXPECT_NE(Terrain(small_highland(), 7).height(3.0, 4.0), Terrain(small_highland(), 8).height(3.0, 4.0));
  EXPECT_EQ(Terrain(small_highland(), 7).height(3.0, 4.0), Terrain(small_highland(), 7).height(3.0, 4.0));
}

TEST(Terrain, CoarsePatchesAreTheMeanOfFineOnes) {
  const Terrain terrain(small_highland(), 7);
  Patch coarse(0.0, 0.0, 0.32, 30, 30);
  terrain.fill(coarse);
  double squares = 0.0;
  for (int iy = 0; iy < 30; ++iy) {
    for (int ix = 0; ix < 30; ++ix)
      squares += std::pow(coarse.at(ix, iy) - terrain.height(coarse.x(ix), coarse.y(iy)), 2);
  }
  EXPECT_LT(std::sqrt(squares / 900.0), 0.04);  // what is left out is below the step: centimetres
}

TEST(Clipmap, ShowsTheTerrainItself) {
  const Terrain terrain(small_highland(), 7);
  Clipmap clipmap(terrain, 128, 100.0);
  clipmap.centre_on({12.0, -7.0});
  for (int i = 0; i < 20; ++i) {  // nodes of the finest level, inside its blended edge
    const double x = 12.0 + 0.02 * i, y = -7.0 - 0.02 * i;
    EXPECT_NEAR(clipmap.shown_height({x, y}), terrain.height(x, y), 2e-3);
  }
}

TEST(Clipmap, LevelsMeetWithoutAStep) {
  const Terrain terrain(small_highland(), 7);
  Clipmap clipmap(terrain, 128, 200.0);
  clipmap.centre_on({3.0, 5.0});
  for (std::size_t k = 0; k + 1 < clipmap.levels().size(); ++k) {
    const Clipmap::Level &fine = clipmap.levels()[k], &coarse = clipmap.levels()[k + 1];
    for (int i = 0; i <= clipmap.cells(); ++i) {  // along the southern edge of the finer level
      const auto offset_x = fine.first_x + i - 2 * coarse.first_x, offset_y = fine.first_y - 2 * coarse.first_y;
      const Clipmap::Vertex& vertex = fine.vertices[i];
      const std::size_t below = (offset_y / 2) * (clipmap.cells() + 1) + offset_x / 2;
      const float expected = offset_x % 2 == 0 ? coarse.vertices[below].z
                                               : 0.5F * (coarse.vertices[below].z + coarse.vertices[below + 1].z);
      EXPECT_NEAR(vertex.z, expected, 1e-5) << k << " " << i;
      const Clipmap::Shade here = clipmap.shade(k, vertex.x, vertex.y),
                           there = clipmap.shade(k + 1, vertex.x, vertex.y);
      EXPECT_NEAR(here.slope_x, there.slope_x, 1e-3);
      EXPECT_NEAR(here.slope_y, there.slope_y, 1e-3);
    }
  }
}

/// Slopes of the surface as it is shown, from the innermost level that covers a position.
Eigen::Vector2d shown_slope(const Clipmap& clipmap, const Eigen::Vector2d& p) {
  for (std::size_t k = 0; k < clipmap.levels().size(); ++k) {
    const Clipmap::Level& level = clipmap.levels()[k];
    const Eigen::Vector2d cell = p / level.step_m - Eigen::Vector2d(level.first_x, level.first_y);
    if (cell.minCoeff() < 0.0 || cell.maxCoeff() > clipmap.cells()) continue;
    const Eigen::Vector2d local = p - clipmap.origin().head<2>();
    const Clipmap::Shade shade =
        clipmap.shade(static_cast<int>(k), static_cast<float>(local.x()), static_cast<float>(local.y()));
    return {shade.slope_x, shade.slope_y};
  }
  return Eigen::Vector2d::Zero();
}

TEST(Clipmap, WalkingAcrossItsSeamsNeitherHeightNorNormalJumps) {
  const Terrain terrain(small_highland(), 7);
  Clipmap clipmap(terrain, 128, 200.0);
  clipmap.centre_on({3.0, 5.0});
  constexpr double kHair = 2e-4;
  for (std::size_t k = 0; k + 1 < clipmap.levels().size(); ++k) {
    const Clipmap::Level& level = clipmap.levels()[k];
    const double east = (level.first_x + clipmap.cells()) * level.step_m, south = level.first_y * level.step_m;
    for (int i = 0; i < 200; ++i) {  // at 200 places of the level's eastern edge
      const double y = south + clipmap.cells() * level.step_m * (i + 0.37) / 200.0;
      const Eigen::Vector2d here(east - kHair, y), there(east + kHair, y);
      EXPECT_NEAR(clipmap.shown_height(here), clipmap.shown_height(there), 1e-3) << level.step_m;
      const Eigen::Vector2d a = shown_slope(clipmap, here), b = shown_slope(clipmap, there);
      const double turn = std::acos(std::min(
          1.0,
          Eigen::Vector3d(-a.x(), -a.y(), 1.0).normalized().dot(Eigen::Vector3d(-b.x(), -b.y(), 1.0).normalized())));
      EXPECT_LT(turn * 180.0 / std::numbers::pi, 0.1) << level.step_m;
    }
  }
}

TEST(Terrain, RisesToHillsBeyondItsEdgeAndNowhereElse) {
  TerrainOptions options = small_highland();
  options.crater_density = 0.0;
  const Terrain terrain(options, 7);
  const double just_inside = terrain.height(99.999, 3.0), just_outside = terrain.height(100.001, 3.0);
  EXPECT_NEAR(just_inside, just_outside, 1e-3);
  double squares = 0.0, far_squares = 0.0;
  for (int i = 0; i < 100; ++i) {
    squares += std::pow(terrain.height(-99.0 + 2.0 * i, 5.0), 2);
    far_squares += std::pow(terrain.height(5000.0 + 300.0 * i, 5.0), 2);
  }
  EXPECT_GT(std::sqrt(far_squares / 100.0), 5.0 * std::sqrt(squares / 100.0));
  EXPECT_LT(std::sqrt(far_squares / 100.0), 500.0);
}

TEST(Terrain, HasACraterWhereOneIsPlaced) {
  TerrainOptions options = small_highland();
  const double before = Terrain(options, 7).height(10.0, 20.0), rim_before = Terrain(options, 7).height(30.0, 20.0);
  options.placed_craters = {{10.0, 20.0, 40.0}};
  const Terrain terrain(options, 7);
  EXPECT_NEAR(terrain.height(10.0, 20.0) - before, -0.13 * 40.0, 1e-6);
  EXPECT_NEAR(terrain.height(30.0, 20.0) - rim_before, 0.04 * 40.0, 1e-6);
}

TEST(Clipmap, DependsOnThePlaceAndNotOnTheWayThere) {
  const Terrain terrain(small_highland(), 7);
  Clipmap direct(terrain, 128, 100.0), roundabout(terrain, 128, 100.0);
  for (double x = -90.0; x < 30.0; x += 1.7) roundabout.centre_on({x, 2.0});
  roundabout.centre_on({30.0, 4.0});
  direct.centre_on({30.0, 4.0});
  ASSERT_EQ(direct.origin(), roundabout.origin());
  for (std::size_t k = 0; k < direct.levels().size(); ++k) {
    ASSERT_EQ(direct.levels()[k].blocks, roundabout.levels()[k].blocks);
    for (std::size_t i = 0; i < direct.levels()[k].shades.size(); ++i) {
      ASSERT_EQ(direct.levels()[k].vertices[i].z, roundabout.levels()[k].vertices[i].z);
    }
  }
}

}  // namespace
}  // namespace demslam

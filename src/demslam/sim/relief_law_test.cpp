#include "demslam/sim/relief_law.h"

#include <gtest/gtest.h>

#include <cmath>

#include "demslam/sim/terrain.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

/// A raster of `cells` squared with the octaves of a law that its cells can hold.
DemRaster fractal_raster(const ReliefLaw& law, int cells, double cell_m) {
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, cells, cell_m);
  Patch patch(raster.centre(0, 0).x(), raster.centre(cells - 1, 0).y(), cell_m, cells, cells);
  for (const Noise& octave : fractal_octaves(law, 11, 2.0 * cell_m, law.outer_scale_m)) octave.add_to(patch);
  for (int row = 0; row < cells; ++row) {
    for (int col = 0; col < cells; ++col) raster.at(row, col) = static_cast<float>(patch.at(col, cells - 1 - row));
  }
  return raster;
}

ReliefLaw law_of(double amplitude_1m, double hurst) {
  ReliefLaw law;
  law.amplitude_1m = amplitude_1m;
  law.hurst = hurst;
  law.outer_scale_m = 1000.0;
  return law;
}

TEST(SecondDifference, OfAPlaneIsZeroAndOfAParabolaItsCurvature) {
  DemRaster raster = plane_raster(3.0, {0.2, -0.1}, 60, 2.0);
  EXPECT_NEAR(second_difference_m(raster, 4), 0.0, 1e-5);
  for (int row = 0; row < 60; ++row) {
    for (int col = 0; col < 60; ++col) raster.at(row, col) = 0.01F * static_cast<float>(col * col + row * row);
  }
  EXPECT_NEAR(second_difference_m(raster, 4), 1.4826 * 0.02 * 16.0, 1e-3);
}

TEST(ContinuedLaw, FindsTheExponentAndTheAmplitudeOfAFractalDem) {
  for (const double hurst : {0.75, 0.9}) {
    const ReliefLaw truth = law_of(0.02, hurst);
    const ReliefLaw found = continued_law(TerrainOptions{}, fractal_raster(truth, 600, 4.0));
    EXPECT_NEAR(found.hurst, hurst, 0.08);
    EXPECT_NEAR(found.amplitude_m(16.0) / truth.amplitude_m(16.0), 1.0, 0.25);
  }
}

TEST(ContinuedLaw, IsThePresetsWhereTheDemIsTooSmall) {
  const TerrainOptions options;
  const ReliefLaw law = continued_law(options, plane_raster(0.0, {0.0, 0.0}, 8, 5.0));
  EXPECT_EQ(law.amplitude_1m, relief_law(options).amplitude_1m);
}

TEST(Terrain, GoesOnBelowTheCellsWhereTheDemsSpectrumEnds) {
  const ReliefLaw truth = law_of(0.03, 0.85);
  TerrainOptions options;
  options.dem = "given";
  options.crater_density = 0.0;
  const Terrain terrain(options, 5, fractal_raster(truth, 400, 4.0));
  DemRaster fine = plane_raster(0.0, {0.0, 0.0}, 400, 0.5);
  Patch patch(fine.centre(0, 0).x(), fine.centre(399, 0).y(), 0.5, 400, 400);
  terrain.fill(patch);
  for (int row = 0; row < 400; ++row) {
    for (int col = 0; col < 400; ++col) fine.at(row, col) = static_cast<float>(patch.at(col, 399 - row));
  }
  // From 2 m, half a cell, to 64 m, sixteen cells: one straight line on double logarithmic paper.
  const double below = second_difference_m(fine, 4), above = second_difference_m(fine, 128);
  EXPECT_NEAR(std::log(above / below) / std::log(32.0), 0.85, 0.12);
}

}  // namespace
}  // namespace demslam

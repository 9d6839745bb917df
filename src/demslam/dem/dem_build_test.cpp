#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/dem/compare.h"
#include "demslam/dem/dem_builder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Points on the plane z = 3 + 0.1 x, with noise, over x in [-5, 5), y in [2, 8).
BuiltDem plane_built(double noise_m, int points) {
  DemBuilder builder({.cell_m = 1.0, .min_points = 3, .sigma_pose_m = 0.01});
  Random random(4);
  for (int i = 0; i < points; ++i) {
    const double x = random.uniform(-5.0, 5.0), y = random.uniform(2.0, 8.0);
    builder.add({x, y, 3.0 + 0.1 * x + noise_m * random.normal()});
  }
  return builder.finish({});
}

TEST(DemBuilder, CellsHoldTheMeanOfTheirPoints) {
  const BuiltDem built = plane_built(0.0, 60000);
  EXPECT_EQ(built.heights.rows, 6);
  EXPECT_EQ(built.heights.cols, 10);
  EXPECT_DOUBLE_EQ(built.heights.west_m, -5.0);
  EXPECT_DOUBLE_EQ(built.heights.north_m, 8.0);
  EXPECT_EQ(built.points, 60000);
  for (int row = 0; row < 6; ++row) {
    for (int col = 0; col < 10; ++col) {
      EXPECT_NEAR(built.heights.at(row, col), 3.0 + 0.1 * built.heights.centre(row, col).x(), 0.01);
    }
  }
}

TEST(DemBuilder, SigmaFallsWithTheNumberOfPointsDownToThatOfThePoses) {
  const BuiltDem few = plane_built(0.2, 600), many = plane_built(0.2, 60000);
  EXPECT_NEAR(few.sigma.at(3, 5), 0.2 / std::sqrt(few.counts.at(3, 5)), 0.03);
  EXPECT_NEAR(many.sigma.at(3, 5), std::hypot(0.2 / std::sqrt(1000.0), 0.01), 0.003);
}

TEST(DemBuilder, CellsWithTooFewPointsAreHoles) {
  DemBuilder builder({.cell_m = 1.0, .min_points = 2});
  for (const double x : {0.5, 0.6, 1.5, 2.5, 2.6}) builder.add({x, 0.5, 1.0});
  const BuiltDem built = builder.finish({});
  EXPECT_EQ(built.filled, 2U);
  EXPECT_TRUE(std::isnan(built.heights.at(0, 1)));
  EXPECT_EQ(built.counts.at(0, 1), 0.0F);
  EXPECT_DOUBLE_EQ(built.hole_fraction(), 1.0 / 3.0);
}

TEST(DemBuilder, RefusesWhatCannotBeRastered) {
  DemBuilder builder({.cell_m = 1.0, .min_points = 2});
  EXPECT_THAT([&] { builder.add({0.0, std::nan(""), 0.0}); }, ThrowsMessage<Error>(HasSubstr("check the poses")));
  EXPECT_THAT([&] { builder.add({1e9, 0.0, 0.0}); }, ThrowsMessage<Error>(HasSubstr("check the poses and the units")));
  builder.add({0.0, 0.0, 0.0});
  EXPECT_THAT([&] { builder.finish({}); }, ThrowsMessage<Error>(HasSubstr("no cell has 2 points")));
  for (const double x : {0.0, 0.0, 9e6, 9e6}) builder.add({x, x, 0.0});
  EXPECT_THAT([&] { builder.finish({}); }, ThrowsMessage<Error>(HasSubstr("too many cells")));
  EXPECT_THROW(DemBuilder({.cell_m = 0.0}), Error);
}

DemRaster slope(double west_m, double bias_m) {
  DemRaster dem{.rows = 12, .cols = 12, .cell_m = 2.0, .west_m = west_m, .north_m = 10.0};
  for (int row = 0; row < 12; ++row) {
    for (int col = 0; col < 12; ++col) {
      dem.heights.push_back(static_cast<float>(0.5 * dem.centre(row, col).x() + bias_m));
    }
  }
  return dem;
}

TEST(CompareDems, MeasuresABiasOnTheGridOfTheFirst) {
  const DemComparison c = compare(slope(0.0, 0.25), slope(0.7, 0.0));
  EXPECT_GT(c.cells, 80U);
  EXPECT_LT(c.cells, 144U);
  EXPECT_NEAR(c.mean_m, 0.25, 1e-5);
  EXPECT_NEAR(c.median_m, 0.25, 1e-5);
  EXPECT_NEAR(c.rms_m, 0.25, 1e-5);
  EXPECT_NEAR(c.std_m, 0.0, 1e-4);
  EXPECT_NEAR(c.nmad_m, 0.0, 1e-4);
  EXPECT_NEAR(c.p95_m, 0.25, 1e-5);
  EXPECT_NEAR(c.difference.at(6, 6), 0.25F, 1e-5F);
  EXPECT_TRUE(std::isnan(c.difference.at(0, 0)));
}

TEST(CompareDems, NmadIsTheSigmaOfNormalErrorsAndIgnoresAnOutlier) {
  DemRaster noisy = slope(0.0, 0.0);
  Random random(3);
  for (float& height : noisy.heights) height += static_cast<float>(0.1 * random.normal());
  noisy.at(5, 5) += 50.0F;
  const DemComparison c = compare(noisy, slope(-2.0, 0.0));
  EXPECT_NEAR(c.nmad_m, 0.1, 0.03);
  EXPECT_GT(c.std_m, 3.0);
}

TEST(CompareDems, FilesMustShareTheirCrsAndDatum) {
  const fs::path folder = fs::path(testing::TempDir()) / "CompareDems";
  fs::create_directories(folder);
  DemRaster moon = slope(0.0, 0.0), earth = slope(0.0, 0.0);
  moon.frame = {crs_wkt_of("IAU_2015:30135"), {0.0, 0.0, 7.0}, HeightDatum::sphere};
  earth.frame.crs_wkt = crs_wkt_of("EPSG:32633");
  write_dem(folder / "moon.tif", moon);
  write_dem(folder / "earth.tif", earth);
  moon.frame.origin = {0.0, 0.0, 9.0};  // the same ground, 2 m higher, from another map origin
  write_dem(folder / "higher.tif", moon);
  EXPECT_NEAR(compare_dems(folder / "higher.tif", folder / "moon.tif").mean_m, 2.0, 1e-5);
  EXPECT_THAT([&] { compare_dems(folder / "moon.tif", folder / "earth.tif"); },
              ThrowsMessage<Error>(HasSubstr("their CRS differ")));
  moon.frame.heights = HeightDatum::geoid;
  write_dem(folder / "geoid.tif", moon);
  EXPECT_THAT([&] { compare_dems(folder / "moon.tif", folder / "geoid.tif"); },
              ThrowsMessage<Error>(HasSubstr("count from the sphere and from the geoid")));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace demslam

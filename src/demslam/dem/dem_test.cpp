#include "demslam/dem/dem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/dem/hillshade.h"
#include "demslam/dem/perturb.h"
#include "demslam/dem/statistics.h"

namespace demslam {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

DemRaster raster_of(int rows, int cols, double cell_m, const std::function<double(double, double)>& height) {
  DemRaster dem{.rows = rows, .cols = cols, .cell_m = cell_m, .west_m = -10.0, .north_m = 20.0};
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const Eigen::Vector2d p = dem.centre(row, col);
      dem.heights.push_back(static_cast<float>(height(p.x(), p.y())));
    }
  }
  return dem;
}

DemRaster rough(int rows, int cols) {
  DemRaster dem = raster_of(rows, cols, 2.0, [](double, double) { return 0.0; });
  return perturb(dem, {.noise_m = {.rms = 1.0, .correlation_length_m = 4.0, .seed = 3}});
}

class EveryInterpolation : public testing::TestWithParam<Interpolation> {};
INSTANTIATE_TEST_SUITE_P(Dem, EveryInterpolation, testing::Values(Interpolation::bilinear, Interpolation::bicubic));

TEST_P(EveryInterpolation, ReproducesAPlaneAndItsGradient) {
  const Dem dem(raster_of(12, 9, 2.0, [](double x, double y) { return 3.0 + 0.25 * x - 0.5 * y; }), GetParam());
  const auto sample = dem.sample(-3.3, 9.1);
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->height_m, 3.0 - 0.25 * 3.3 - 0.5 * 9.1, 1e-5);
  EXPECT_NEAR(sample->gradient.x(), 0.25, 1e-5);
  EXPECT_NEAR(sample->gradient.y(), -0.5, 1e-5);
  EXPECT_LT(sample->hessian.norm(), 1e-5);
}

TEST_P(EveryInterpolation, HeightsStandAtCellCentres) {
  const Dem dem(rough(10, 10), GetParam());
  const Eigen::Vector2d p = dem.raster().centre(4, 6);
  EXPECT_NEAR(dem.height(p.x(), p.y()).value(), dem.raster().at(4, 6), 1e-6);
  EXPECT_NEAR(dem.sample(p.x(), p.y())->height_m, dem.raster().at(4, 6), 1e-6);
}

TEST_P(EveryInterpolation, GradientAtACellCentreIsTheCentralDifference) {
  const Dem dem(rough(10, 10), GetParam());
  const Eigen::Vector2d p = dem.raster().centre(4, 6);
  EXPECT_TRUE(dem.sample(p.x(), p.y())->gradient.isApprox(cell_gradient(dem.raster(), 4, 6), 1e-6));
}

TEST_P(EveryInterpolation, HessianIsTheDerivativeOfTheGradient) {
  const Dem dem(rough(20, 20), GetParam());
  const double step = 1e-5;
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const double x = random.uniform(-5.0, 20.0), y = random.uniform(-10.0, 15.0);
    const auto at = [&](double dx, double dy) { return dem.sample(x + dx, y + dy)->gradient; };
    Eigen::Matrix2d numeric;
    numeric.col(0) = (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step);
    numeric.col(1) = (at(0.0, step) - at(0.0, -step)) / (2.0 * step);
    EXPECT_LT((dem.sample(x, y)->hessian - numeric).norm(), 1e-6) << x << " " << y;
  }
}

TEST_P(EveryInterpolation, HasNoValueOutsideOrBesideAHole) {
  DemRaster raster = rough(10, 10);
  raster.at(5, 5) = kNaN;
  const Dem dem(raster, GetParam());
  const Eigen::Vector2d hole = raster.centre(5, 5);
  EXPECT_FALSE(dem.sample(hole.x(), hole.y()));
  EXPECT_FALSE(dem.height(hole.x() + 1.9, hole.y()));
  EXPECT_FALSE(dem.sample(-10.1, 10.0));
  EXPECT_FALSE(dem.sample(1e12, 10.0));
  EXPECT_FALSE(dem.sample(std::nan(""), 10.0));
  EXPECT_FALSE(dem.height(0.0, 20.5));
}

TEST(Dem, BicubicGradientIsTheHeightsOwn) {
  const Dem dem(rough(20, 20));
  const double step = 1e-5;
  Random random(8);
  for (int i = 0; i < 50; ++i) {
    const double x = random.uniform(-5.0, 20.0), y = random.uniform(-10.0, 15.0);
    const Eigen::Vector2d numeric((*dem.height(x + step, y) - *dem.height(x - step, y)) / (2.0 * step),
                                  (*dem.height(x, y + step) - *dem.height(x, y - step)) / (2.0 * step));
    EXPECT_LT((dem.sample(x, y)->gradient - numeric).norm(), 1e-6);
  }
}

TEST(Dem, BicubicGradientIsContinuousAcrossCellEdges) {
  const Dem dem(rough(20, 20));
  const double edge_x = dem.raster().centre(9, 9).x();
  const auto left = dem.sample(edge_x - 1e-7, 3.3), right = dem.sample(edge_x + 1e-7, 3.3);
  EXPECT_LT((left->gradient - right->gradient).norm(), 1e-5);
}

TEST(Dem, RefusesARasterWhoseSizesDoNotFit) {
  DemRaster raster = rough(4, 4);
  raster.heights.pop_back();
  EXPECT_THROW(Dem{raster}, Error);
}

TEST(Crop, KeepsEveryCellWhereItWas) {
  const DemRaster whole = rough(20, 30);
  const DemRaster part = crop(whole, {.west_m = 0.0, .south_m = -5.0, .east_m = 11.0, .north_m = 9.0});
  const Dem big(whole), small(part);
  EXPECT_EQ(part.cols, 6);
  EXPECT_EQ(part.rows, 8);
  EXPECT_NEAR(*big.height(5.3, 1.7), *small.height(5.3, 1.7), 1e-12);
}

TEST(Crop, RefusesAWindowBesideTheDem) {
  EXPECT_THROW(crop(rough(5, 5), {.west_m = 100.0, .south_m = 0.0, .east_m = 110.0, .north_m = 5.0}), Error);
}

double mean_product(const std::vector<float>& field, int rows, int cols, int lag) {
  double sum = 0.0;
  std::size_t count = 0;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col + lag < cols; ++col, ++count) {
      sum += static_cast<double>(field[row * cols + col]) * field[row * cols + col + lag];
    }
  }
  return sum / static_cast<double>(count);
}

TEST(GaussianField, HasTheStatedRmsAndCorrelationLength) {
  const auto field = gaussian_field({.rms = 0.5, .correlation_length_m = 10.0, .seed = 5}, 600, 600, 2.0);
  const double variance = mean_product(field, 600, 600, 0);
  EXPECT_NEAR(std::sqrt(variance), 0.5, 0.01);
  EXPECT_NEAR(mean_product(field, 600, 600, 5) / variance, std::exp(-1.0), 0.02);   // 10 m
  EXPECT_NEAR(mean_product(field, 600, 600, 10) / variance, std::exp(-4.0), 0.02);  // 20 m
}

TEST(GaussianField, IsTheSameForTheSameSeedOnly) {
  const GaussianField field{.rms = 1.0, .correlation_length_m = 6.0, .seed = 9};
  EXPECT_EQ(gaussian_field(field, 20, 30, 2.0), gaussian_field(field, 20, 30, 2.0));
  EXPECT_NE(gaussian_field(field, 20, 30, 2.0), gaussian_field({1.0, 6.0, 10}, 20, 30, 2.0));
}

TEST(Perturb, AddsTheBiasAndMovesTheTerrain) {
  const DemRaster clean = rough(20, 20);
  const Dem before(clean), after(perturb(clean, {.bias_m = 0.5, .shift_m = {1.5, -2.5}}));
  EXPECT_NEAR(*after.height(6.5, 0.5), *before.height(5.0, 3.0) + 0.5, 1e-5);
}

TEST(Perturb, LeavesHolesHoles) {
  DemRaster raster = rough(5, 5);
  raster.at(2, 2) = kNaN;
  EXPECT_TRUE(std::isnan(perturb(raster, {.noise_m = {.rms = 1.0}, .bias_m = 1.0}).at(2, 2)));
}

TEST(Statistics, OfAPlaneWithAHole) {
  DemRaster plane = raster_of(11, 11, 2.0, [](double x, double) { return x; });
  plane.at(0, 0) = kNaN;
  plane.frame.origin.z() = 100.0;
  const DemStatistics s = statistics(plane);
  EXPECT_EQ(s.cells, 121U);
  EXPECT_EQ(s.holes, 1U);
  EXPECT_NEAR(s.min_m, 91.0, 1e-5);
  EXPECT_NEAR(s.max_m, 111.0, 1e-5);
  EXPECT_NEAR(s.slope_median_deg, 45.0, 1e-4);
}

TEST(Hillshade, IsTheSineOfTheSunsElevationOnFlatGround) {
  const DemRaster flat = raster_of(5, 5, 1.0, [](double, double) { return 7.0; });
  EXPECT_NEAR(hillshade(flat, {.sun_elevation_deg = 30.0})[12], 0.5, 1e-6);
  EXPECT_TRUE(std::isnan(hillshade(flat)[0]));
}

TEST(Hillshade, SlopesThatFaceTheSunAreBrighter) {
  const DemRaster west_facing = raster_of(5, 5, 1.0, [](double x, double) { return 0.3 * x; });
  const float lit = hillshade(west_facing, {.sun_azimuth_deg = 270.0})[12];
  const float away = hillshade(west_facing, {.sun_azimuth_deg = 90.0})[12];
  EXPECT_GT(lit, away + 0.3F);
}

}  // namespace
}  // namespace demslam

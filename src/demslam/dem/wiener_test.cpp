#include "demslam/dem/wiener.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

DemRaster flat(int side) {
  DemRaster dem{.rows = side, .cols = side, .cell_m = 5.0, .west_m = 0.0, .north_m = 5.0 * side};
  dem.heights.assign(static_cast<std::size_t>(side) * side, 0.0F);
  return dem;
}

DemRaster hills(int side, double rms_m) {
  return perturb(flat(side), {.noise_m = {.rms = rms_m, .correlation_length_m = 150.0, .seed = 1}});
}

DemRaster noisy(const DemRaster& dem) {
  return perturb(dem, {.noise_m = {.rms = 0.5, .correlation_length_m = 6.0, .seed = 2}});
}

double rms_difference(const DemRaster& a, const DemRaster& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.heights.size(); ++i) sum += std::pow(a.heights[i] - b.heights[i], 2);
  return std::sqrt(sum / static_cast<double>(a.heights.size()));
}

struct Filtered {
  DemRaster dem;
  DemErrorModel remaining;
};

Filtered filtered(const DemRaster& dem, const DemErrorModel& error) {
  const WienerFilter filter = WienerFilter::of(dem, error).value();
  return {filter.filtered(dem, dem.extent()), filter.remaining()};
}

const DemErrorModel kError{.sigma_m = 0.5, .correlation_length_m = 5.0};

TEST(WienerFilter, TakesNoiseOutOfWeakRelief) {
  const DemRaster truth = hills(120, 1.0);
  const Filtered result = filtered(noisy(truth), kError);
  const double error_m = rms_difference(result.dem, truth);
  EXPECT_LT(error_m, 0.25);
  EXPECT_NEAR(result.remaining.sigma_m, error_m, 0.5 * error_m);
  EXPECT_GT(result.remaining.correlation_length_m, kError.correlation_length_m);
}

TEST(WienerFilter, LeavesStrongReliefAlone) {
  DemRaster rugged = flat(120);
  Random random(4);
  for (float& h : rugged.heights) h = static_cast<float>(20.0 * random.normal());
  EXPECT_LT(rms_difference(filtered(rugged, {.sigma_m = 0.05, .correlation_length_m = 5.0}).dem, rugged), 1.0);
}

TEST(WienerFilter, PassesAPlaneUnchangedUpToItsEdges) {
  DemRaster plane = flat(60);
  for (int row = 0; row < 60; ++row) {
    for (int col = 0; col < 60; ++col) plane.at(row, col) = static_cast<float>(0.3 * col - 0.2 * row);
  }
  EXPECT_LT(rms_difference(filtered(plane, kError).dem, plane), 1e-4);
}

TEST(WienerFilter, LeavesHolesHolesAndTheirNeighboursValid) {
  DemRaster dem = noisy(hills(60, 1.0));
  dem.at(30, 30) = std::numeric_limits<float>::quiet_NaN();
  const DemRaster result = filtered(dem, kError).dem;
  EXPECT_TRUE(std::isnan(result.at(30, 30)));
  EXPECT_TRUE(std::isfinite(result.at(30, 31)));
}

TEST(WienerFilter, FiltersAPartAsItDoesTheWhole) {
  const DemRaster dem = noisy(hills(60, 1.0));
  const WienerFilter filter = WienerFilter::of(dem, kError).value();
  const DemRaster whole = filter.filtered(dem, dem.extent());
  const MapWindow window{52.0, 101.0, 149.0, 198.0};
  EXPECT_EQ(filter.filtered(dem, window).heights, crop(whole, window).heights);
}

TEST(WienerFilter, KnowsWhetherItsNoiseIsThere) {
  const DemRaster dem = noisy(hills(120, 1.0));  // 0.5 m
  const auto found = [&](const DemRaster& in, double sigma_m) {
    return WienerFilter::of(in, {sigma_m, 5.0}).value().noise_found(in).value();
  };
  EXPECT_NEAR(found(dem, 0.5), 1.0, 0.3);
  EXPECT_GT(found(dem, 0.25), 1.2);
  EXPECT_LT(found(dem, 2.0), 0.5);
  // A crest is no noise.
  DemRaster crested = dem;
  for (int row = 0; row < 120; ++row) {
    for (int col = 0; col < 120; ++col) crested.at(row, col) -= 2.0F * static_cast<float>(std::abs(col - 60));
  }
  EXPECT_LT(found(crested, 2.0), 0.6);
}

TEST(WienerFilter, DemsThatCannotBeFilteredAreBelievedAsTheyAre) {
  const auto small = std::make_shared<const Dem>(flat(10));
  EXPECT_EQ(most_probable(small, kError).dem, small);
  EXPECT_EQ(most_probable(small, kError).error.sigma_m, kError.sigma_m);
  Dem with_sigma(noisy(hills(120, 1.0)));
  with_sigma.set_sigma(small);
  const auto varying = std::make_shared<const Dem>(std::move(with_sigma));
  EXPECT_EQ(most_probable(varying, kError).dem, varying);
  const auto large_enough = std::make_shared<const Dem>(noisy(hills(120, 1.0)));
  EXPECT_LT(most_probable(large_enough, kError).error.sigma_m, kError.sigma_m);
}

}  // namespace
}  // namespace demslam

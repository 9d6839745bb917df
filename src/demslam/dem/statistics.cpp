#include "demslam/dem/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace demslam {
namespace {

std::vector<float> slopes_deg(const DemRaster& dem) {
  std::vector<float> slopes;
  for (int row = 1; row + 1 < dem.rows; ++row) {
    for (int col = 1; col + 1 < dem.cols; ++col) {
      const double slope = cell_gradient(dem, row, col).norm();
      if (std::isfinite(slope)) slopes.push_back(static_cast<float>(std::atan(slope) * 180.0 / std::numbers::pi));
    }
  }
  return slopes;
}

double quantile(std::vector<float>& values, double fraction) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

Eigen::Vector2d cell_gradient(const DemRaster& dem, int row, int col) {
  if (row < 1 || col < 1 || row + 1 >= dem.rows || col + 1 >= dem.cols) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  const double span_m = 2.0 * dem.cell_m;
  return {(dem.at(row, col + 1) - dem.at(row, col - 1)) / span_m,
          (dem.at(row - 1, col) - dem.at(row + 1, col)) / span_m};
}

DemStatistics statistics(const DemRaster& dem) {
  DemStatistics result{.cells = dem.heights.size()};
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0.0;
  for (const float h : dem.heights) {
    if (!std::isfinite(h)) {
      ++result.holes;
      continue;
    }
    low = std::min(low, static_cast<double>(h));
    high = std::max(high, static_cast<double>(h));
    sum += h;
  }
  if (result.holes == result.cells) return result;
  const double origin_m = dem.frame.origin.z();
  result.min_m = low + origin_m;
  result.max_m = high + origin_m;
  result.mean_m = sum / static_cast<double>(result.cells - result.holes) + origin_m;
  std::vector<float> slopes = slopes_deg(dem);
  result.slope_median_deg = quantile(slopes, 0.5);
  result.slope_p95_deg = quantile(slopes, 0.95);
  return result;
}

}  // namespace demslam

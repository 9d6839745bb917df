#include "demslam/dem/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "demslam/dem/dem_reader.h"

namespace demslam {
namespace {

constexpr std::int64_t kMostSlopes = 4'000'000;
constexpr int kStripCells = 4'000'000;

double slope_deg(const DemRaster& dem, int row, int col) {
  return std::atan(cell_gradient(dem, row, col).norm()) * 180.0 / std::numbers::pi;
}

double quantile(std::vector<float>& values, double fraction) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Gathers the figures strip by strip.
class Sum {
 public:
  explicit Sum(const DemRaster& grid)
      : origin_m_(grid.frame.origin.z()), stride_(static_cast<std::int64_t>(grid.rows) * grid.cols / kMostSlopes + 1) {}

  /// Rows `begin` to `end` of a strip; the rows about them are their neighbours.
  void add(const DemRaster& strip, int begin, int end) {
    for (int row = begin; row < end; ++row) {
      for (int col = 0; col < strip.cols; ++col) {
        add_height(strip.at(row, col));
        if (seen_++ % stride_ == 0) add_slope(slope_deg(strip, row, col));
      }
    }
  }
  DemStatistics result() {
    DemStatistics result{.cells = static_cast<std::size_t>(seen_), .holes = holes_};
    if (result.holes == result.cells) return result;
    result.min_m = low_ + origin_m_;
    result.max_m = high_ + origin_m_;
    result.mean_m = sum_ / static_cast<double>(result.cells - result.holes) + origin_m_;
    result.slope_median_deg = quantile(slopes_, 0.5);
    result.slope_p95_deg = quantile(slopes_, 0.95);
    return result;
  }

 private:
  void add_height(float height) {
    if (!std::isfinite(height)) {
      ++holes_;
      return;
    }
    low_ = std::min(low_, static_cast<double>(height));
    high_ = std::max(high_, static_cast<double>(height));
    sum_ += height;
  }
  void add_slope(double slope_deg) {
    if (std::isfinite(slope_deg)) slopes_.push_back(static_cast<float>(slope_deg));
  }

  double origin_m_;
  std::int64_t stride_, seen_ = 0;
  std::size_t holes_ = 0;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_, sum_ = 0.0;
  std::vector<float> slopes_;
};

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
  Sum sum(dem);
  sum.add(dem, 0, dem.rows);
  return sum.result();
}

DemStatistics statistics(const std::filesystem::path& dem_file) {
  DemReader reader(dem_file);
  const DemRaster& grid = reader.grid();
  Sum sum(grid);
  const int step = std::max(1, kStripCells / grid.cols);
  for (int row = 0; row < grid.rows; row += step) {
    const int first = std::max(0, row - 1), end = std::min(grid.rows, row + step + 1);  // neighbours for the slopes
    const DemRaster strip = reader.read({first, 0, end - first, grid.cols});
    sum.add(strip, row - first, std::min(grid.rows, row + step) - first);
  }
  return sum.result();
}

}  // namespace demslam

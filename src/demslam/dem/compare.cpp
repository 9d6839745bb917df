#include "demslam/dem/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// Differences at every cell of `a`, NaN where either has no height.
DemRaster difference_of(const DemRaster& a, const Dem& b) {
  DemRaster difference = a;
  difference.frame.origin.z() = 0.0;
  difference.frame.heights = HeightDatum::unstated;
  for (int row = 0; row < a.rows; ++row) {
    for (int col = 0; col < a.cols; ++col) {
      const Eigen::Vector2d p = a.centre(row, col);
      const auto height_m = b.height(p.x(), p.y());
      difference.at(row, col) =
          height_m ? static_cast<float>(a.at(row, col) - *height_m) : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return difference;
}

double quantile(std::vector<double> values, double fraction) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> distances_from(const std::vector<double>& values, double centre) {
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return distances;
}

void add_moments(const std::vector<double>& values, DemComparison& comparison) {
  double sum = 0.0, squares = 0.0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  const auto count = static_cast<double>(values.size());
  comparison.mean_m = sum / count;
  comparison.rms_m = std::sqrt(squares / count);
  comparison.std_m = std::sqrt(std::max(0.0, squares / count - comparison.mean_m * comparison.mean_m));
}

}  // namespace

DemComparison compare(const DemRaster& a, const DemRaster& b) {
  DemComparison comparison{.difference = difference_of(a, Dem(b, Interpolation::bilinear))};
  std::vector<double> values;
  for (const float value : comparison.difference.heights) {
    if (std::isfinite(value)) values.push_back(value);
  }
  if (values.empty()) throw Error("the two DEMs have no cell in common");
  comparison.cells = values.size();
  add_moments(values, comparison);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  comparison.min_m = *low;
  comparison.max_m = *high;
  comparison.median_m = quantile(values, 0.5);
  comparison.nmad_m = 1.4826 * quantile(distances_from(values, comparison.median_m), 0.5);
  comparison.p95_m = quantile(distances_from(values, 0.0), 0.95);
  return comparison;
}

DemComparison compare_dems(const std::filesystem::path& a_file, const std::filesystem::path& b_file) {
  const DemRaster a = read_dem(a_file), b = read_dem(b_file, a.frame.origin);
  const std::string both = a_file.string() + " and " + b_file.string();
  if (!same_crs(a.frame, b.frame)) throw Error(both + ": their CRS differ; reproject one of them (gdalwarp -t_srs)");
  const bool stated = a.frame.heights != HeightDatum::unstated && b.frame.heights != HeightDatum::unstated;
  if (stated && a.frame.heights != b.frame.heights) {
    throw Error(both + ": the heights count from the " + std::string(name_of(a.frame.heights)) + " and from the " +
                std::string(name_of(b.frame.heights)) + "; bring one to the other with 'demslam dem crop --heights'");
  }
  return compare(a, b);
}

}  // namespace demslam

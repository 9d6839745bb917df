#include "demslam/anchoring/skyline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace demslam {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

double highest_elevation(const Dem& dem, const Eigen::Vector3d& p_map, double azimuth_rad, const SkylineOptions& o) {
  const Eigen::Vector2d direction(std::cos(azimuth_rad), std::sin(azimuth_rad));
  const double cell_m = dem.raster().cell_m;
  double highest = -0.5 * std::numbers::pi;
  for (double range_m = o.min_range_m; range_m < o.max_range_m; range_m += std::max(0.5 * cell_m, 2e-3 * range_m)) {
    const auto height = dem.height(p_map.x() + range_m * direction.x(), p_map.y() + range_m * direction.y());
    if (!height) continue;
    const double sink_m = o.radius_m > 0.0 ? range_m * range_m / (2.0 * o.radius_m) : 0.0;
    highest = std::max(highest, std::atan2(*height - sink_m - p_map.z(), range_m));
  }
  return highest;
}

}  // namespace

std::pair<std::size_t, double> Skyline::place(double azimuth_rad) const {
  const auto n = static_cast<double>(elevation_rad_.size());
  double at = azimuth_rad / kTurn * n;
  at -= n * std::floor(at / n);
  const std::size_t index = std::min(elevation_rad_.size() - 1, static_cast<std::size_t>(at));
  return {index, at - static_cast<double>(index)};
}

double Skyline::elevation(double azimuth_rad) const {
  const auto [index, part] = place(azimuth_rad);
  const double next = elevation_rad_[(index + 1) % elevation_rad_.size()];
  return elevation_rad_[index] + part * (next - elevation_rad_[index]);
}

double Skyline::slope(double azimuth_rad) const {
  const std::size_t index = place(azimuth_rad).first;
  const double next = elevation_rad_[(index + 1) % elevation_rad_.size()];
  return (next - elevation_rad_[index]) / kTurn * static_cast<double>(elevation_rad_.size());
}

double Skyline::roughness() const {
  double sum = 0.0;
  const std::size_t n = elevation_rad_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double step = (elevation_rad_[(i + 1) % n] - elevation_rad_[i]) / kTurn * static_cast<double>(n);
    sum += step * step;
  }
  return std::sqrt(sum / static_cast<double>(n));
}

Skyline skyline_from(const Dem& dem, const Eigen::Vector3d& p_map, const SkylineOptions& options) {
  std::vector<double> elevation_rad;
  for (int i = 0; i < options.azimuths; ++i) {
    elevation_rad.push_back(highest_elevation(dem, p_map, kTurn * i / options.azimuths, options));
  }
  return Skyline(std::move(elevation_rad));
}

}  // namespace demslam

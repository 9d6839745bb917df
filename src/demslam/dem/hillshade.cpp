#include "demslam/dem/hillshade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/dem/statistics.h"

namespace demslam {

std::vector<float> hillshade(const DemRaster& dem, const Hillshade& light) {
  const double azimuth = light.sun_azimuth_deg * std::numbers::pi / 180.0;
  const double elevation = light.sun_elevation_deg * std::numbers::pi / 180.0;
  const Eigen::Vector3d sun(std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation),
                            std::sin(elevation));
  std::vector<float> shades;
  shades.reserve(dem.heights.size());
  for (int row = 0; row < dem.rows; ++row) {
    for (int col = 0; col < dem.cols; ++col) {
      const Eigen::Vector2d g = light.exaggeration * cell_gradient(dem, row, col);
      const double shade = Eigen::Vector3d(-g.x(), -g.y(), 1.0).normalized().dot(sun);
      shades.push_back(std::isnan(shade) ? static_cast<float>(shade) : static_cast<float>(std::max(0.0, shade)));
    }
  }
  return shades;
}

}  // namespace demslam

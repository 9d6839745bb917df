#include "demslam/sim/wheel_tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace demslam {
namespace {

constexpr double kStep = 5.0, kBehind = 2.0;                // metres
constexpr double kHalfWidth = 0.1, kDepth = 0.018;          // of a rut
constexpr double kRim = 0.006, kRimWidth = 0.05;            // the soil pressed out beside it
constexpr double kGrouser = 0.003, kGrouserSpacing = 0.06;  // bars across the wheel
constexpr double kReach = kHalfWidth + 3.0 * kRimWidth;     // beside a wheel's middle
constexpr std::size_t kStride = 3;                          // points of the route per straight piece

/// Height of the ground across a rut, `across` from its middle, after `s_m` of the route.
double rut(double s_m, double across) {
  const double a = std::abs(across);
  const double floor = 1.0 - smooth_step(kHalfWidth - 0.03, kHalfWidth + 0.02, a);
  const double rim = std::exp(-std::pow((a - kHalfWidth - 0.04) / kRimWidth, 2));
  const double bars = kGrouser * std::sin(2.0 * std::numbers::pi * s_m / kGrouserSpacing);
  return (bars - kDepth) * floor + kRim * rim * (1.0 - floor);
}

/// Presses one straight piece of the way into `pressed`; where pieces overlap, the deeper counts.
void press(const Patch& patch, const Route& route, double half_track_m, std::size_t from_point, std::size_t to_point,
           std::vector<double>& pressed) {
  const Eigen::Vector2d from = route.points()[from_point], to = route.points()[to_point];
  const double length = std::max((to - from).norm(), 1e-9), reach = half_track_m + kReach;
  const Eigen::Vector2d along = (to - from) / length;
  const Eigen::Vector2d low = from.cwiseMin(to).array() - reach, high = from.cwiseMax(to).array() + reach;
  const NodeSpan columns = nodes_between(patch.x0, patch.step, patch.nx, low.x(), high.x());
  const NodeSpan rows = nodes_between(patch.y0, patch.step, patch.ny, low.y(), high.y());
  for (int iy = rows.first; iy <= rows.last; ++iy) {
    for (int ix = columns.first; ix <= columns.last; ++ix) {
      const Eigen::Vector2d offset = Eigen::Vector2d(patch.x(ix), patch.y(iy)) - from;
      const double s = offset.dot(along), left = along.x() * offset.y() - along.y() * offset.x();
      if (s < -0.05 * length || s > 1.05 * length || std::abs(left) > reach) continue;
      double& value = pressed[static_cast<std::size_t>(iy) * patch.nx + ix];
      const double height = rut(route.arc_m(from_point) + s, std::abs(left) - half_track_m);
      if (std::abs(height) > std::abs(value)) value = height;
    }
  }
}

}  // namespace

void WheelTracks::set_driven(double s_m) {
  steps_ = static_cast<std::uint64_t>(std::max(0.0, std::floor((s_m - kBehind) / kStep)));
}

void WheelTracks::add_to(Patch& patch) const {
  const double driven = kStep * static_cast<double>(steps_), reach = half_track_m_ + kReach;
  if (driven <= 0.0) return;
  std::vector<double> pressed(patch.values.size(), 0.0);
  for (const Route::Run& run : route_.runs_in(low_corner(patch, reach), high_corner(patch, reach))) {
    for (std::size_t i = run.first; i < run.last && route_.arc_m(i) < driven; i += kStride) {
      press(patch, route_, half_track_m_, i, std::min(i + kStride, run.last), pressed);
    }
  }
  for (std::size_t k = 0; k < pressed.size(); ++k) patch.values[k] += pressed[k];
}

}  // namespace demslam

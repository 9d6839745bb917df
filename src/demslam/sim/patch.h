#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace demslam {

/// Values at the nodes of a regular grid in the map frame: node (ix, iy) stands at (x0 + ix * step, y0 + iy * step),
/// metres.
struct Patch {
  double x0 = 0.0, y0 = 0.0, step = 1.0;
  int nx = 0, ny = 0;
  std::vector<double> values;  ///< row iy after row, nx each

  Patch() = default;
  Patch(double x0_m, double y0_m, double step_m, int nodes_x, int nodes_y)
      : x0(x0_m),
        y0(y0_m),
        step(step_m),
        nx(nodes_x),
        ny(nodes_y),
        values(static_cast<std::size_t>(nodes_x) * nodes_y, 0.0) {}

  double x(int ix) const { return x0 + ix * step; }
  double y(int iy) const { return y0 + iy * step; }
  double* row(int iy) { return values.data() + static_cast<std::size_t>(iy) * nx; }
  const double* row(int iy) const { return values.data() + static_cast<std::size_t>(iy) * nx; }
  double at(int ix, int iy) const { return row(iy)[ix]; }
};

/// Value and gradient of a field at one point.
struct FieldSample {
  double value = 0.0, dx = 0.0, dy = 0.0;
};

/// 0 below `low`, 1 above `high`, smooth between.
inline double smooth_step(double low, double high, double x) {
  const double t = std::fmin(std::fmax((x - low) / (high - low), 0.0), 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace demslam

#include "demslam/sim/lens.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace demslam {
namespace {

Eigen::Vector2d radtan(const std::array<double, 5>& k, const Eigen::Vector2d& xy) {
  const auto& [k1, k2, p1, p2, k3] = k;
  const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

/// Distance from the image's middle of a ray at an angle from the axis, in focal lengths.
double equidistant(const std::array<double, 5>& k, double angle) {
  const double a2 = angle * angle;
  return angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
}

Eigen::Vector2d undo_radtan(const std::array<double, 5>& k, const Eigen::Vector2d& image) {
  Eigen::Vector2d xy = image;
  for (int i = 0; i < 100; ++i) {  // contracts for every lens whose distortion is well below one
    const Eigen::Vector2d correction = image - radtan(k, xy);
    xy += correction;
    if (correction.squaredNorm() < 1e-20) break;
  }
  return xy;
}

Eigen::Vector2d undo_equidistant(const std::array<double, 5>& k, const Eigen::Vector2d& image) {
  const double distance = image.norm();
  double angle = distance;
  for (int i = 0; i < 100; ++i) {
    const double correction = distance - equidistant(k, angle);
    angle += correction;
    if (std::abs(correction) < 1e-12) break;
  }
  if (!(angle < kEdgeDeg * std::numbers::pi / 180.0)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return distance > 0.0 ? Eigen::Vector2d(std::tan(angle) / distance * image) : image;
}

}  // namespace

Eigen::Vector2d distorted(const Camera& camera, const Eigen::Vector2d& xy) {
  if (camera.distortion == Distortion::none) return xy;
  if (camera.distortion == Distortion::radtan) return radtan(camera.coefficients, xy);
  const double distance = xy.norm();
  return distance > 0.0 ? Eigen::Vector2d(equidistant(camera.coefficients, std::atan(distance)) / distance * xy) : xy;
}

Eigen::Vector3d ray_of(const Camera& camera, double u, double v) {
  const Eigen::Vector2d image((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
  Eigen::Vector2d xy = image;
  if (camera.distortion == Distortion::radtan) xy = undo_radtan(camera.coefficients, image);
  if (camera.distortion == Distortion::equidistant) xy = undo_equidistant(camera.coefficients, image);
  return {xy.x(), xy.y(), 1.0};
}

}  // namespace demslam

#include "demslam/sim/lens.h"

namespace demslam {

Eigen::Vector2d distorted(const Camera& camera, const Eigen::Vector2d& xy) {
  if (camera.distortion == Distortion::none) return xy;
  const auto& [k1, k2, p1, p2, k3] = camera.coefficients;
  const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

Eigen::Vector3d ray_of(const Camera& camera, double u, double v) {
  const Eigen::Vector2d image((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
  Eigen::Vector2d xy = image;
  if (camera.distortion != Distortion::none) {
    for (int i = 0; i < 100; ++i) {  // contracts for every lens whose distortion is well below one
      const Eigen::Vector2d correction = image - distorted(camera, xy);
      xy += correction;
      if (correction.squaredNorm() < 1e-20) break;
    }
  }
  return {xy.x(), xy.y(), 1.0};
}

}  // namespace demslam

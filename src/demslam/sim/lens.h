#pragma once

#include "demslam/geometry/camera.h"

namespace demslam {

/// The distorted image of a point (x, y) at unit depth, in units of the focal length. Radtan (Brown-Conrady),
/// equidistant (Kannala-Brandt) or none.
Eigen::Vector2d distorted(const Camera& camera, const Eigen::Vector2d& xy);

/// The ray (x, y, 1) of a pixel: the inverse of projection and distortion, to 1e-9 where the distortion is invertible.
/// NaN where a fisheye looks sideways or back (beyond kEdgeDeg from its axis): no camera ray has z = 1 there.
Eigen::Vector3d ray_of(const Camera& camera, double u, double v);
inline constexpr double kEdgeDeg = 88.0;

}  // namespace demslam

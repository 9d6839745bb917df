#pragma once

#include "demslam/geometry/camera.h"

namespace demslam {

/// The distorted image of a point (x, y) at unit depth, in units of the focal length. Radtan (Brown-Conrady) or none.
Eigen::Vector2d distorted(const Camera& camera, const Eigen::Vector2d& xy);

/// The ray (x, y, 1) of a pixel: the inverse of projection and distortion, to 1e-9 where the distortion is invertible.
Eigen::Vector3d ray_of(const Camera& camera, double u, double v);

}  // namespace demslam

#pragma once

#include "demslam/sim/renderer.h"

namespace demslam {

/// The sun as a camera sees it.
struct SunInView {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< of its centre, perhaps outside the image
  double radius_px = 0.0;
  double seen = 0.0;  ///< share of its disc that nothing hides; 0 also where it stands beside or behind the camera
};

/// Looks for the sun; what hides it is found by rays.
SunInView find_sun(const Renderer& renderer, const LightOptions& light, const Camera& camera, const Pose& T_map_camera);

/// Adds the sun's disc to the black sky (I/F = 1 / sin^2 of its radius), and with `flare` > 0 what the lens scatters: a
/// veil of I/F = 0.3 flare pi seen / (angle^2 + 1), angle in degrees from the sun, and four ghosts on the line through
/// the image's middle, of 0.01 flare.
void add_sun(Rendering& rendering, const Camera& camera, const LightOptions& light, const SunInView& sun, double flare);

}  // namespace demslam

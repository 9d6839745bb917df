#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "demslam/sim/illumination.h"
#include "demslam/sim/renderer.h"

namespace demslam {

/// What the ray through a pixel's centre met, as far as it spares further rays of the pixel.
struct CentreHit {
  static constexpr std::uint8_t kNoGround = 255;

  Eigen::Vector3f facet = Eigen::Vector3f::Zero();  ///< normal of the grid's triangle, not unit
  std::uint8_t level = kNoGround;                   ///< of the clipmap
  Sunlight sun = Sunlight::turned_away;
};

/// A pixel whose mean one ray does not give.
struct RoughPixel {
  enum class Kind : std::uint8_t {
    traced,   ///< an outline, a bend or the edge of a shadow: rays have to be cast
    lit,      ///< unbroken ground, sunlit all around: only its texture has to be looked up
    shadowed  ///< unbroken ground, in shadow all around
  };
  std::size_t pixel;
  Kind kind;
};

/// The pixels that differ from a neighbour in brightness by a quarter; those of a kind together, in blocks of four by
/// four.
std::vector<RoughPixel> rough_pixels(const Rendering& image, const std::vector<CentreHit>& centres);

/// Depth of the plane through a pixel of unbroken ground, du and dv pixels from its centre.
float plane_depth(const Rendering& image, std::size_t pixel, double du, double dv);

}  // namespace demslam

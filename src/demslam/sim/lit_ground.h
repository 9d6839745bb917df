#pragma once

#include <embree4/rtcore.h>

#include <Eigen/Core>
#include <vector>

#include "demslam/sim/clipmap.h"

namespace demslam {

/// How brightly the sun lights the ground around the rover, averaged over a few metres: 1 is a level sunlit plain, 0
/// lies in shadow. Made by one ray to the sun for every half metre, out to 32 m; farther away the edge's values hold.
class LitGround {
 public:
  /// Looks at a clipmap and everything that casts shadows on it; `sun` is the direction to it.
  void build(const Clipmap& clipmap, RTCScene scene, const Eigen::Vector3f& sun);

  /// At a place relative to the clipmap's origin.
  float at(float x, float y) const;

 private:
  static constexpr int kCells = 128;
  static constexpr float kCell = 0.5F;  // metres

  void light_row(const Clipmap& clipmap, RTCScene scene, const Eigen::Vector3f& sun, int row);

  float west_ = 0.0F, south_ = 0.0F;  ///< of the first cell's centre
  std::vector<float> light_;
};

}  // namespace demslam

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "demslam/sim/patch.h"

namespace demslam {

/// What lies on the natural ground and is fine in detail: soil banked up against rocks, wheel tracks. Part of the
/// terrain that is seen, not of that which an orbiter measures or on which the rover's way is computed.
class GroundLayer {
 public:
  static constexpr double kFinest = 0.09;  ///< patches of a coarser step do not show layers

  virtual ~GroundLayer() = default;
  virtual void add_to(Patch& patch) const = 0;
  /// Changes when what add_to() adds has changed.
  virtual std::uint64_t revision() const { return 0; }
};

/// The corners of a patch, moved out by a reach.
inline Eigen::Vector2d low_corner(const Patch& patch, double reach_m) {
  return {patch.x0 - reach_m, patch.y0 - reach_m};
}
inline Eigen::Vector2d high_corner(const Patch& patch, double reach_m) {
  return {patch.x(patch.nx - 1) + reach_m, patch.y(patch.ny - 1) + reach_m};
}

/// Nodes [first, last] of a patch's axis that lie between two positions; empty when first > last.
struct NodeSpan {
  int first, last;
};
NodeSpan nodes_between(double origin, double step, int count, double low, double high);

}  // namespace demslam

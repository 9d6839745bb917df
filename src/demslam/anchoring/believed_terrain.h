#pragma once

#include <Eigen/Core>
#include <memory>

#include "demslam/anchoring/dem_noise.h"

namespace demslam {

/// The DEM as factors around the rover should see it: filtered for as much noise as was stated or, where that is to be
/// estimated, as the patches show. Only around the rover: a DEM of 10 km x 10 km takes seconds to filter.
class BelievedTerrain {
 public:
  BelievedTerrain(std::shared_ptr<const Dem> dem, const DemErrorModel& stated, bool filter, bool estimate_noise);

  /// A patch at its present pose.
  void add(const TerrainPatch& patch, const Pose& T_map_body) {
    if (estimate_noise_) noise_.add(patch, T_map_body);
  }
  double noise_scale() const { return noise_.scale(); }
  /// It reaches 125 m and 50 cells beyond the place at least, where the DEM does.
  const BelievedDem& around(const Eigen::Vector2d& place_m);

 private:
  std::shared_ptr<const Dem> dem_;
  bool estimate_noise_;
  DemNoise noise_;
  double reach_m_;  ///< from the middle of what is filtered at a time to its edges
  BelievedDem believed_;
  const WienerFilter* made_with_ = nullptr;  ///< of noise_
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();
};

}  // namespace demslam

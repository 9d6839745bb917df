#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/geometry/pose.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

/// How far the final poses are from what one measurement between two keyframes said.
struct RelativeResidual {
  std::size_t i = 0, j = 0;
  double translation_m = 0.0, rotation_deg = 0.0;  ///< of T_i_j^-1 * T_i^-1 * T_j
  double chi_square = 0.0;  ///< 6 degrees of freedom, by the measurement's own covariance; NaN: not known
};
RelativeResidual residual_of(const RelativePose& measurement, const Pose& T_map_i, const Pose& T_map_j);

/// How far a pose is from the terrain, as the DEM factors see it (anchoring/dem_factors.h). NaN outside the DEM.
struct TerrainResidual {
  double height_m = 0.0;    ///< ground contact point above the DEM
  double normal_deg = 0.0;  ///< body's up axis from the DEM's normal
};
TerrainResidual residual_of(const Dem& dem, const Pose& T_map_body, const Eigen::Vector3d& p_body_ground);

}  // namespace demslam

#pragma once

#include "demslam/anchoring/terrain_patch.h"

namespace demslam {

/// The part of a submap's relief that the DEM explains at `T_map_body`: 1 - chi-square of its heights above the DEM
/// over that of the heights themselves, both about their own best plane and whitened by the DEM's error. Near 1 in the
/// right place; in a wrong one a search makes it positive, but not large. Zero off the DEM.
double explained_relief(const TerrainPatch& submap, const Pose& T_map_body, const Dem& dem,
                        const DemErrorModel& dem_error);

}  // namespace demslam

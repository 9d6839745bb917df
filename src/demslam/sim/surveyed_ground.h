#pragma once

#include "demslam/dem/dem_builder.h"
#include "demslam/sim/mission.h"

namespace demslam {

/// The map that a rover's LiDAR gathers along the drive when every pose is known: a scan each `spacing_m`, rasterised;
/// rocks are part of it, and what no scan sees is a hole. As Dai et al. (IEEE Aerospace 2026) made the DEMs of the
/// LuSNAR scenes.
BuiltDem surveyed_ground(Mission& mission, double spacing_m, const DemBuildOptions& options);

}  // namespace demslam

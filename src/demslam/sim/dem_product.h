#pragma once

#include "demslam/dem/dem.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// The true ground (without rocks) averaged over cells, around the trajectory with a margin, as far as the base surface
/// goes. Cells whose base has no data stay without.
DemRaster averaged_ground(const Terrain& terrain, const Trajectory& trajectory, const DemProductOptions& options);

/// What an orbiter's product makes of it: gaps between altimeter tracks, correlated noise, bias, shift.
DemRaster degraded(const DemRaster& truth, const DemProductOptions& options, std::uint64_t seed);

}  // namespace demslam

#pragma once

#include "demslam/dem/dem.h"
#include "demslam/dem/error_model.h"

namespace demslam {

/// The most probable terrain below a noisy DEM, and what error it still has.
struct FilteredDem {
  DemRaster dem;
  DemErrorModel remaining;
};

/// Wiener filter of a DEM, as a local best linear unbiased estimate (universal kriging with a linear drift, so that
/// planes pass unchanged). The terrain's own spectrum is a power law fitted to the DEM's variogram after the error's is
/// taken out. Where relief dominates, the kernel is almost a unit impulse; where noise does, a wide mean. Holes stay
/// holes; next to them and at the edge less is filtered. Throws Error when the DEM is too small to know its own
/// spectrum.
FilteredDem wiener_filtered(const DemRaster& dem, const DemErrorModel& error);

}  // namespace demslam

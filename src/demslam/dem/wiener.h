#pragma once

#include <memory>
#include <optional>

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
/// holes; next to them and at the edge less is filtered. None when the DEM is too small to know its own spectrum, or so
/// large that it is read by tiles.
std::optional<FilteredDem> wiener_filtered(const DemRaster& dem, const DemErrorModel& error);

/// A map as an estimator should see it, with its error.
struct BelievedDem {
  std::shared_ptr<const Dem> dem;
  DemErrorModel error;
};

/// Filtered where that is possible and the error is the same everywhere; else, and where an uncertainty raster says how
/// it varies, as it is.
BelievedDem most_probable(std::shared_ptr<const Dem> dem, const DemErrorModel& error);

}  // namespace demslam

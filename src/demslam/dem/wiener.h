#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>

#include "demslam/dem/dem.h"
#include "demslam/dem/error_model.h"

namespace demslam {

/// Whether two windows share any ground.
bool touch(const MapWindow& a, const MapWindow& b);

/// Wiener filter of a DEM, as a local best linear unbiased estimate (universal kriging with a linear drift, so that
/// planes pass unchanged). The terrain's own spectrum is a power law fitted to the DEM's variogram after the error's is
/// taken out. Where relief dominates, the kernel is almost a unit impulse; where noise does, a wide mean.
class WienerFilter {
 public:
  /// None when the DEM is too small to know its own spectrum, or so large that it is read by tiles.
  static std::optional<WienerFilter> of(const DemRaster& dem, const DemErrorModel& error);

  /// The most probable terrain in the cells that touch a window. Holes stay holes; next to them and at the DEM's edge
  /// less is filtered. Throws Error when the window lies outside.
  DemRaster filtered(const DemRaster& dem, const MapWindow& window) const;
  /// What error it still has.
  const DemErrorModel& remaining() const { return remaining_; }
  /// What it takes away from a DEM, over what it should take away if there is as much noise as it is made for: standard
  /// deviations, that of the DEM by the median over a thousand cells, which a crest or a cliff does not move. Nothing
  /// where there are no such cells.
  std::optional<double> noise_found(const DemRaster& dem) const;

 private:
  WienerFilter(Eigen::VectorXd weights, const DemErrorModel& remaining, double takes_away_m)
      : weights_(std::move(weights)), remaining_(remaining), takes_away_m_(takes_away_m) {}

  Eigen::VectorXd weights_;  ///< of the window around a cell
  DemErrorModel remaining_;
  double takes_away_m_;  ///< from a DEM with the noise it is made for, standard deviation
};

/// A map as an estimator should see it, with its error.
struct BelievedDem {
  std::shared_ptr<const Dem> dem;
  DemErrorModel error;
};

/// Filtered where that is possible and the error is the same everywhere; else, and where an uncertainty raster says how
/// it varies, as it is.
BelievedDem most_probable(std::shared_ptr<const Dem> dem, const DemErrorModel& error);
/// Of the cells that touch a window alone; as it is where the window does not touch the DEM.
BelievedDem most_probable(std::shared_ptr<const Dem> dem, const DemErrorModel& error, const MapWindow& window);

}  // namespace demslam

#pragma once

#include <filesystem>

#include "demslam/dem/dem.h"

namespace demslam {

/// What to cut out of a DEM of any CRS, degrees included.
struct LocalCut {
  double lon_deg = 0.0, lat_deg = 0.0;  ///< centre, on the DEM's own body
  double radius_m = 500.0;              ///< half the side of the square
  double cell_m = 5.0;                  ///< of the result
};

/// Cuts a square around a point and resamples it (bicubic) into a transverse Mercator projection centred there, on the
/// DEM's own body, whose scale is true at the terrain's mean height (2500 m up on Earth, a metre of the ellipsoid is
/// 0.4 mm longer): metric, conformal, scale error below 1e-6 within 2 km on the Moon. The point becomes the map's
/// origin (height 0, or the band's offset). Throws Error when the file has no CRS or the square holds no data at all.
DemRaster read_dem_around(const std::filesystem::path& file, const LocalCut& cut);

}  // namespace demslam

#pragma once

#include <vector>

#include "demslam/dem/dem.h"

namespace demslam {

struct Hillshade {
  double sun_azimuth_deg = 315.0;  ///< clockwise from North, where the light comes from
  double sun_elevation_deg = 35.0;
  double exaggeration = 1.0;  ///< of the heights
};

/// Lambert shading in [0, 1] of every cell, row-major as the raster; NaN at holes and at the border. No cast shadows.
std::vector<float> hillshade(const DemRaster& dem, const Hillshade& light = {});

}  // namespace demslam

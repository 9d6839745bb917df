#pragma once

#include "demslam/dem/local_frame.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// Unit vector, map frame, towards a body in the sky; azimuth from East to North.
Eigen::Vector3d sky_direction(double elevation_deg, double azimuth_deg);

/// The light with the sun where it stands at light.utc, seen from the map's origin: the place is the DEM's where its
/// frame has a CRS, else the scene's longitude and latitude. The direction is that of the map's own axes, whichever way
/// its projection turns them. Without a time the light stays as it is. Throws Error when the sun is below the horizon.
LightOptions light_at_time(LightOptions light, const LocalFrame& frame);

}  // namespace demslam

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/image/canvas.h"

namespace demslam {

/// One line on the map.
struct MapTrack {
  std::string label;
  Colour colour;
  Trajectory trajectory;  ///< poses in the map frame
};

struct MapPictureOptions {
  std::string title;
  int width = 1200;                ///< pixels; the height follows from the ground shown
  double margin = 0.15;            ///< of the tracks' extent, on each side
  double sun_azimuth_deg = 315.0;  ///< of the shading, clockwise from North, as cartographers light a map
  double sun_elevation_deg = 40.0;
};

/// The tracks over the shaded DEM, North up, with a scale bar and a legend. Throws Error when there is nothing to draw.
Canvas draw_map_picture(const Dem& dem, const std::vector<MapTrack>& tracks, const MapPictureOptions& options);

}  // namespace demslam

#pragma once

#include <string>

#include "demslam/dem/local_frame.h"
#include "demslam/geometry/trajectory.h"

namespace demslam {

/// A track in longitude, latitude (degrees) and height (metres, of the frame's datum) for geographic programs. On
/// another body than WGS84's Earth the GeoJSON names its CRS ("crs", which GDAL and QGIS honour); KML cannot, and is
/// marked with the body as Google Earth's `hint`. Throws Error when the frame has no CRS.
std::string geojson_track(const Trajectory& T_map_body, const LocalFrame& frame, const std::string& name);
std::string kml_track(const Trajectory& T_map_body, const LocalFrame& frame, const std::string& name);

}  // namespace demslam

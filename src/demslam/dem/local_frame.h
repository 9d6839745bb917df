#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace demslam {

/// What heights count from. A file that does not say is `unstated`; `radius` is the body's centre (planetary shape
/// maps).
enum class HeightDatum { unstated, radius, sphere, ellipsoid, geoid };

std::string_view name_of(HeightDatum datum);
/// Nothing when there is no datum of that name.
std::optional<HeightDatum> height_datum_named(std::string_view name);

/// The local East-North-Up frame `map` (metres) and its tie to the world.
/// A projected CRS is used as it is, shifted: map x = easting - origin_easting, y = northing - origin_northing,
/// z = height - origin_height (so a DEM raster needs no resampling; the projection's own scale error is part of the
/// frame, docs/conventions.md).
struct LocalFrame {
  std::string crs_wkt;                               ///< empty: a DEM without CRS, metres assumed by the user's word
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< easting, northing, height of the map's origin in that CRS
  HeightDatum heights = HeightDatum::unstated;       ///< of the origin's height
};

/// The frame's heights, stated to be above `datum`: radii become heights above the CRS's sphere; heights above a geoid
/// become ellipsoidal where the geoid's undulation (geoid above ellipsoid) is given. Only the origin's height changes.
/// Throws Error where that cannot be true: no CRS, a sphere that is an ellipsoid, radii that are none.
LocalFrame with_heights(LocalFrame frame, HeightDatum datum, const std::optional<double>& geoid_undulation_m);

/// The semi-major axis of the body that the frame's CRS is on, metres. Throws Error when there is no CRS.
double semi_major_axis_m(const LocalFrame& frame);

/// Do two frames share their CRS (or have none both)? Their origins may differ.
bool same_crs(const LocalFrame& a, const LocalFrame& b);

/// WKT of a CRS in any form that GDAL knows: "EPSG:32633", "IAU_2015:30135", PROJ text, WKT. Throws Error.
std::string crs_wkt_of(const std::string& user_input);

/// Longitude, latitude (degrees, on the body of the DEM's own CRS) and height (metres, of the DEM's own datum) of map
/// points, through PROJ. Throws Error when the frame has no CRS, or where its projection is not defined.
/// One instance is used by one thread at a time.
class Georeference {
 public:
  explicit Georeference(const LocalFrame& frame);
  ~Georeference();
  Georeference(Georeference&&) noexcept;
  Eigen::Vector3d lon_lat_height(const Eigen::Vector3d& p_map) const;
  Eigen::Vector3d map_from_lon_lat_height(const Eigen::Vector3d& lon_lat_height) const;

 private:
  struct Transform;
  std::unique_ptr<Transform> transform_;
};

}  // namespace demslam

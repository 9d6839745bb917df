#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

namespace demslam {

/// The local East-North-Up frame `map` (metres) and its tie to the world.
/// A projected CRS is used as it is, shifted: map x = easting - origin_easting, y = northing - origin_northing,
/// z = height - origin_height (so a DEM raster needs no resampling; the projection's own scale error is part of the
/// frame, docs/conventions.md).
struct LocalFrame {
  std::string crs_wkt;                               ///< empty: a DEM without CRS, metres assumed by the user's word
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< easting, northing, height of the map's origin in that CRS
};

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

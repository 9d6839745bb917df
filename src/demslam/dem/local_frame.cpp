#include "demslam/dem/local_frame.h"

#include "demslam/dem/internal/gdal_support.h"

namespace demslam {

struct Georeference::Transform {
  Eigen::Vector3d origin;
  std::unique_ptr<OGRCoordinateTransformation> to_geographic, from_geographic;
};

namespace {

std::unique_ptr<OGRCoordinateTransformation> between(const OGRSpatialReference& from, const OGRSpatialReference& to) {
  std::unique_ptr<OGRCoordinateTransformation> transform(OGRCreateCoordinateTransformation(&from, &to));
  if (!transform) throw Error("no way between the DEM's CRS and longitude/latitude: " + QuietGdal::message());
  return transform;
}

Eigen::Vector2d transformed(OGRCoordinateTransformation& transform, double x, double y) {
  const QuietGdal quiet;
  if (!transform.Transform(1, &x, &y)) {
    throw Error("a position outside the area where the DEM's projection is defined: " + QuietGdal::message());
  }
  return {x, y};
}

}  // namespace

Georeference::Georeference(const LocalFrame& frame) : transform_(std::make_unique<Transform>()) {
  if (frame.crs_wkt.empty())
    throw Error("the DEM carries no CRS, so there is no longitude and latitude; assign one (gdal_edit -a_srs)");
  const QuietGdal quiet;
  const OGRSpatialReference crs = spatial_reference(frame.crs_wkt);
  const std::unique_ptr<OGRSpatialReference, decltype(&OGRSpatialReference::DestroySpatialReference)> geographic(
      crs.CloneGeogCS(), &OGRSpatialReference::DestroySpatialReference);
  if (!geographic) throw Error("the DEM's CRS has no geographic base, so there is no longitude and latitude");
  geographic->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  transform_->origin = frame.origin;
  transform_->to_geographic = between(crs, *geographic);
  transform_->from_geographic = between(*geographic, crs);
}

Georeference::~Georeference() = default;
Georeference::Georeference(Georeference&&) noexcept = default;

Eigen::Vector3d Georeference::lon_lat_height(const Eigen::Vector3d& p_map) const {
  const Eigen::Vector3d p = transform_->origin + p_map;
  const Eigen::Vector2d lon_lat = transformed(*transform_->to_geographic, p.x(), p.y());
  return {lon_lat.x(), lon_lat.y(), p.z()};
}

Eigen::Vector3d Georeference::map_from_lon_lat_height(const Eigen::Vector3d& lon_lat_height) const {
  const Eigen::Vector2d p = transformed(*transform_->from_geographic, lon_lat_height.x(), lon_lat_height.y());
  return Eigen::Vector3d(p.x(), p.y(), lon_lat_height.z()) - transform_->origin;
}

}  // namespace demslam

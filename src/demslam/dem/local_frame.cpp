#include "demslam/dem/local_frame.h"

#include <array>
#include <cmath>

#include "demslam/dem/internal/gdal_support.h"

namespace demslam {

struct Georeference::Transform {
  Eigen::Vector3d origin;
  std::unique_ptr<OGRCoordinateTransformation> to_geographic, from_geographic;
};

namespace {

constexpr std::array<std::pair<HeightDatum, std::string_view>, 5> kDatums = {{{HeightDatum::unstated, "unstated"},
                                                                              {HeightDatum::radius, "radius"},
                                                                              {HeightDatum::sphere, "sphere"},
                                                                              {HeightDatum::ellipsoid, "ellipsoid"},
                                                                              {HeightDatum::geoid, "geoid"}}};

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

LocalFrame with_radii(LocalFrame frame, double semi_major_m) {
  frame.origin.z() -= semi_major_m;
  if (std::abs(frame.origin.z()) > 0.05 * semi_major_m) {
    throw Error("the DEM's heights are no radii of its body (" + std::to_string(semi_major_m) +
                " m); say what they count from");
  }
  frame.heights = HeightDatum::sphere;
  return frame;
}

}  // namespace

std::string_view name_of(HeightDatum datum) { return kDatums.at(static_cast<std::size_t>(datum)).second; }

std::optional<HeightDatum> height_datum_named(std::string_view name) {
  for (const auto& [datum, its_name] : kDatums) {
    if (its_name == name) return datum;
  }
  return std::nullopt;
}

LocalFrame with_heights(LocalFrame frame, HeightDatum datum, const std::optional<double>& geoid_undulation_m) {
  if (geoid_undulation_m && datum != HeightDatum::geoid) {
    throw Error("a geoid undulation belongs to heights above a geoid, not to '" + std::string(name_of(datum)) + "'");
  }
  if (datum == HeightDatum::radius) return with_radii(std::move(frame), semi_major_axis_m(frame));
  if (datum == HeightDatum::sphere && spatial_reference(frame.crs_wkt).GetInvFlattening() != 0.0) {
    throw Error("the DEM's CRS is on an ellipsoid, its heights cannot count from a sphere");
  }
  frame.heights = geoid_undulation_m ? HeightDatum::ellipsoid : datum;
  frame.origin.z() += geoid_undulation_m.value_or(0.0);
  return frame;
}

double semi_major_axis_m(const LocalFrame& frame) { return spatial_reference(frame.crs_wkt).GetSemiMajor(); }

bool same_crs(const LocalFrame& a, const LocalFrame& b) {
  if (a.crs_wkt.empty() || b.crs_wkt.empty()) return a.crs_wkt.empty() && b.crs_wkt.empty();
  const QuietGdal quiet;
  const OGRSpatialReference crs_b = spatial_reference(b.crs_wkt);
  const char* const options[] = {"CRITERION=EQUIVALENT", nullptr};
  return spatial_reference(a.crs_wkt).IsSame(&crs_b, options) != 0;
}

std::string crs_wkt_of(const std::string& user_input) {
  const QuietGdal quiet;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(user_input.c_str()) != OGRERR_NONE) {
    throw Error("'" + user_input +
                "' is no CRS that PROJ knows; give a code like EPSG:32633 or IAU_2015:30135, or WKT");
  }
  return wkt_of(crs);
}

Georeference::Georeference(const LocalFrame& frame) : transform_(std::make_unique<Transform>()) {
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

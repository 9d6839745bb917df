#include "demslam/dem/geo_track.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "demslam/base/text.h"
#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kWgs84SemiMajor_m = 6378137.0, kMoonRadius_m = 1737400.0, kMarsSemiMajor_m = 3396190.0;

bool on_earth(double semi_major_m) { return std::abs(semi_major_m - kWgs84SemiMajor_m) < 10.0; }

/// The geographic CRS as GDAL reads it back: "IAU_2015:30100" where it has a code, else WKT.
std::string geographic_crs(const LocalFrame& frame) {
  const QuietGdal quiet;
  const OGRSpatialReference crs = spatial_reference(frame.crs_wkt);
  const std::unique_ptr<OGRSpatialReference, decltype(&OGRSpatialReference::DestroySpatialReference)> geographic(
      crs.CloneGeogCS(), &OGRSpatialReference::DestroySpatialReference);
  if (!geographic) throw Error("the DEM's CRS has no geographic base, so there is no longitude and latitude");
  const char *authority = geographic->GetAuthorityName(nullptr), *code = geographic->GetAuthorityCode(nullptr);
  if (authority != nullptr && code != nullptr) return std::string(authority) + ":" + code;
  return wkt_of(*geographic);
}

/// Google Earth's names of the bodies it has.
std::string kml_hint(double semi_major_m) {
  if (std::abs(semi_major_m - kMoonRadius_m) < 1000.0) return " hint=\"target=moon\"";
  if (std::abs(semi_major_m - kMarsSemiMajor_m) < 10000.0) return " hint=\"target=mars\"";
  return "";
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return result;
}

}  // namespace

std::string geojson_track(const Trajectory& T_map_body, const LocalFrame& frame, const std::string& name) {
  const Georeference georeference(frame);
  Json line = Json::array(), stamps = Json::array();
  for (const auto& [t_ns, pose] : T_map_body) {
    const Eigen::Vector3d p = georeference.lon_lat_height(pose.translation());
    line.push_back({p.x(), p.y(), p.z()});
    stamps.push_back(seconds_text(t_ns));
  }
  Json collection = {{"type", "FeatureCollection"}, {"name", name}};
  if (!on_earth(semi_major_axis_m(frame))) {
    collection["crs"] = {{"type", "name"}, {"properties", {{"name", geographic_crs(frame)}}}};
  }
  const Json properties = {{"name", name}, {"heights", name_of(frame.heights)}, {"timestamps_s", stamps}};
  collection["features"] = {
      {{"type", "Feature"}, {"properties", properties}, {"geometry", {{"type", "LineString"}, {"coordinates", line}}}}};
  return collection.dump(1) + "\n";
}

std::string kml_track(const Trajectory& T_map_body, const LocalFrame& frame, const std::string& name) {
  const Georeference georeference(frame);
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"" +
                     kml_hint(semi_major_axis_m(frame)) + ">\n<Document>\n<name>" + escaped(name) +
                     "</name>\n<Placemark>\n<name>" + escaped(name) +
                     "</name>\n<LineString>\n<altitudeMode>absolute</altitudeMode>\n<coordinates>\n";
  for (const StampedPose& stamped : T_map_body) {
    const Eigen::Vector3d p = georeference.lon_lat_height(stamped.pose.translation());
    char line[96];
    std::snprintf(line, sizeof line, "%.10f,%.10f,%.4f\n", p.x(), p.y(), p.z());
    text += line;
  }
  return text + "</coordinates>\n</LineString>\n</Placemark>\n</Document>\n</kml>\n";
}

}  // namespace demslam

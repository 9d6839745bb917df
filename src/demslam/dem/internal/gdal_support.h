#pragma once

// Private to dem/*.cpp: the only files that see GDAL.
#include <cpl_error.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <filesystem>
#include <memory>
#include <string>

#include "demslam/base/error.h"
#include "demslam/dem/dem.h"

namespace demslam {

/// Keeps GDAL off the user's terminal while it lives; its last message goes into our one-line errors instead.
class QuietGdal {
 public:
  static constexpr GIntBig kCacheBytes = 64 << 20;  ///< of raster blocks; what is read often is kept by us
  QuietGdal() {
    static const bool registered = (GDALAllRegister(), GDALSetCacheMax64(kCacheBytes), true);
    static_cast<void>(registered);
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
  }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

  static std::string message() {
    const std::string text = CPLGetLastErrorMsg();
    return text.empty() ? "no reason given" : text.substr(0, text.find('\n'));
  }
};

using GdalDataset = GDALDatasetUniquePtr;

// What travels with the files that we write: "easting northing height" of the map's origin, and what heights count
// from.
constexpr const char* kOriginItem = "DEMSLAM_MAP_ORIGIN";
constexpr const char* kHeightsItem = "DEMSLAM_HEIGHTS";

/// The PDS label of a bare image, if it lies beside it: "LDEM_4.IMG" has "LDEM_4.LBL" (PDS3) or "LDEM_4.xml" (PDS4).
inline std::filesystem::path label_of(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (extension != ".IMG" && extension != ".img") return file;
  for (const char* label : {".LBL", ".lbl", ".xml", ".XML"}) {
    std::filesystem::path beside = file;
    if (std::filesystem::exists(beside.replace_extension(label))) return beside;
  }
  return file;
}

inline GdalDataset open_raster(const std::filesystem::path& file) {
  GdalDataset dataset(
      GDALDataset::Open(label_of(file).c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (!dataset) throw Error(file.string() + ": cannot be read as a DEM: " + QuietGdal::message());
  if (dataset->GetRasterCount() < 1) throw Error(file.string() + ": holds no raster band");
  return dataset;
}

/// Band 1 of an open dataset as a DEM; `name` is for the errors. See read_dem().
DemRaster raster_of(GDALDataset& dataset, const std::string& name, const std::optional<Eigen::Vector3d>& origin);

inline OGRSpatialReference spatial_reference(const std::string& wkt) {
  if (wkt.empty()) {
    throw Error("the DEM carries no CRS, so there is no longitude and latitude; assign one (gdal_edit -a_srs)");
  }
  OGRSpatialReference crs;
  if (crs.importFromWkt(wkt.c_str()) != OGRERR_NONE) throw Error("the DEM's CRS cannot be understood by GDAL/PROJ");
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
}

inline std::string wkt_of(const OGRSpatialReference& crs) {
  char* text = nullptr;
  const char* const options[] = {"FORMAT=WKT2", nullptr};
  crs.exportToWkt(&text, options);
  const std::string wkt = text == nullptr ? "" : text;
  CPLFree(text);
  return wkt;
}

}  // namespace demslam

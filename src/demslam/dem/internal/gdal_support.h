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
  QuietGdal() {
    static const bool registered = (GDALAllRegister(), true);
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

inline GdalDataset open_raster(const std::filesystem::path& file) {
  GdalDataset dataset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (!dataset) throw Error(file.string() + ": cannot be read as a DEM: " + QuietGdal::message());
  if (dataset->GetRasterCount() < 1) throw Error(file.string() + ": holds no raster band");
  return dataset;
}

/// Band 1 of an open dataset as a DEM; `name` is for the errors. See read_dem().
DemRaster raster_of(GDALDataset& dataset, const std::string& name, const std::optional<Eigen::Vector3d>& origin);

inline OGRSpatialReference spatial_reference(const std::string& wkt) {
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

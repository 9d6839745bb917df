#include <cmath>
#include <sstream>
#include <system_error>

#include "demslam/dem/dem.h"
#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

constexpr float kNoData = -99999.0F;

[[noreturn]] void fail_writing(const std::filesystem::path& file, const std::filesystem::path& temporary,
                               const std::string& reason) {
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  throw Error(file.string() + ": cannot be written (disk full, or folder missing or read-only?): " + reason);
}

bool write_frame(GDALDataset& dataset, const LocalFrame& frame) {
  if (!frame.crs_wkt.empty()) {
    const OGRSpatialReference crs = spatial_reference(frame.crs_wkt);
    if (dataset.SetSpatialRef(&crs) != CE_None) return false;
  }
  std::ostringstream origin;
  origin.precision(17);
  origin << frame.origin.x() << ' ' << frame.origin.y() << ' ' << frame.origin.z();
  if (dataset.SetMetadataItem(kOriginItem, origin.str().c_str()) != CE_None) return false;
  if (frame.heights == HeightDatum::unstated) return true;
  return dataset.SetMetadataItem(kHeightsItem, std::string(name_of(frame.heights)).c_str()) == CE_None;
}

/// Fills an open dataset; false where GDAL refuses.
bool fill(GDALDataset& dataset, const DemRaster& dem) {
  double g[6] = {dem.frame.origin.x() + dem.west_m,  dem.cell_m, 0.0,
                 dem.frame.origin.y() + dem.north_m, 0.0,        -dem.cell_m};
  if (dataset.SetGeoTransform(g) != CE_None || !write_frame(dataset, dem.frame)) return false;
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  band.SetNoDataValue(kNoData);
  std::vector<float> row_heights(dem.cols);
  for (int row = 0; row < dem.rows; ++row) {
    for (int col = 0; col < dem.cols; ++col) {
      const double z = dem.at(row, col) + dem.frame.origin.z();
      row_heights[col] = std::isfinite(z) ? static_cast<float>(z) : kNoData;
    }
    if (band.RasterIO(GF_Write, 0, row, dem.cols, 1, row_heights.data(), dem.cols, 1, GDT_Float32, 0, 0) != CE_None) {
      return false;
    }
  }
  return true;
}

}  // namespace

void write_dem(const std::filesystem::path& file, const DemRaster& dem) {
  const QuietGdal quiet;
  const std::filesystem::path temporary = file.string() + ".part";
  const char* const options[] = {"TILED=YES", "COMPRESS=LZW", "PREDICTOR=3", "BIGTIFF=IF_SAFER", nullptr};
  GdalDataset dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      temporary.c_str(), dem.cols, dem.rows, 1, GDT_Float32, const_cast<char**>(options)));
  if (!dataset) fail_writing(file, temporary, QuietGdal::message());
  const bool filled = fill(*dataset, dem);
  const bool closed = GDALClose(dataset.release()) == CE_None && CPLGetLastErrorType() < CE_Failure;
  if (!filled || !closed) fail_writing(file, temporary, QuietGdal::message());
  std::error_code renamed;
  std::filesystem::rename(temporary, file, renamed);
  if (renamed) fail_writing(file, temporary, renamed.message());
}

}  // namespace demslam

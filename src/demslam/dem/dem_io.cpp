#include <cmath>
#include <limits>
#include <sstream>
#include <system_error>
#include <utility>

#include "demslam/dem/dem.h"
#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

constexpr float kNoData = -99999.0F;
constexpr const char* kOriginItem =
    "DEMSLAM_MAP_ORIGIN";  // "easting northing height": the map frame travels with the file

using GeoTransform = double[6];  // GDAL's: x = g[0] + col g[1] + row g[2], y = g[3] + col g[4] + row g[5], cell corners

void check_placement(const std::string& name, const GeoTransform& g) {
  if (g[2] != 0.0 || g[4] != 0.0) throw Error(name + ": the raster is rotated; reproject it north-up (gdalwarp)");
  if (!(g[1] > 0.0 && g[5] < 0.0)) throw Error(name + ": the raster is not north-up; reproject it (gdalwarp)");
  if (std::abs(g[1] + g[5]) > 1e-4 * g[1]) {
    throw Error(name + ": cells are not square (" + std::to_string(g[1]) + " x " + std::to_string(-g[5]) +
                "); resample the DEM (gdalwarp -tr)");
  }
}

/// WKT of the dataset's CRS; empty when it has none (metres are then the user's word).
std::string metric_crs(const std::string& name, const OGRSpatialReference* crs) {
  if (crs == nullptr) return "";
  if (crs->IsGeographic()) {
    throw Error(name +
                ": the DEM is in degrees, metres are needed; cut and reproject a part of it with "
                "'demslam dem crop --center LON LAT --radius-m R'");
  }
  if (std::abs(crs->GetLinearUnits() - 1.0) > 1e-9) {
    throw Error(name + ": the DEM's CRS is not in metres; reproject it (gdalwarp -t_srs)");
  }
  return wkt_of(*crs);
}

/// Heights of one band: value * scale + offset - height of the origin; NaN where GDAL's mask says no-data.
class BandReader {
 public:
  BandReader(GDALRasterBand& band, std::string name, double origin_height_m)
      : band_(band),
        name_(std::move(name)),
        scale_(band.GetScale()),
        offset_(band.GetOffset() - origin_height_m),
        cols_(band.GetXSize()) {
    values_.resize(cols_);
    valid_.resize(cols_);
  }

  void read_row(int row, float* heights) {
    GDALRasterBand& mask = *band_.GetMaskBand();
    if (band_.RasterIO(GF_Read, 0, row, cols_, 1, values_.data(), cols_, 1, GDT_Float64, 0, 0) != CE_None ||
        mask.RasterIO(GF_Read, 0, row, cols_, 1, valid_.data(), cols_, 1, GDT_Byte, 0, 0) != CE_None) {
      throw Error(name_ + ": row " + std::to_string(row) + " cannot be read: " + QuietGdal::message());
    }
    for (int col = 0; col < cols_; ++col) {
      heights[col] = valid_[col] == 0 ? std::numeric_limits<float>::quiet_NaN()
                                      : static_cast<float>(values_[col] * scale_ + offset_);
    }
  }

 private:
  GDALRasterBand& band_;
  std::string name_;
  double scale_, offset_;
  int cols_;
  std::vector<double> values_;
  std::vector<unsigned char> valid_;
};

/// The origin the file itself names (write_dem does), else the centre of its extent.
Eigen::Vector3d default_origin(GDALDataset& dataset, const GeoTransform& g, GDALRasterBand& band) {
  if (const char* item = dataset.GetMetadataItem(kOriginItem)) {
    Eigen::Vector3d origin;
    std::istringstream numbers(item);
    if (numbers >> origin.x() >> origin.y() >> origin.z()) return origin;
  }
  return {g[0] + 0.5 * band.GetXSize() * g[1], g[3] + 0.5 * band.GetYSize() * g[5], band.GetOffset()};
}

[[noreturn]] void fail_writing(const std::filesystem::path& file, const std::filesystem::path& temporary,
                               const std::string& reason) {
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  throw Error(file.string() + ": cannot be written (disk full, or folder missing or read-only?): " + reason);
}

/// Fills an open dataset; false where GDAL refuses.
bool fill(GDALDataset& dataset, const DemRaster& dem) {
  GeoTransform g = {dem.frame.origin.x() + dem.west_m,  dem.cell_m, 0.0,
                    dem.frame.origin.y() + dem.north_m, 0.0,        -dem.cell_m};
  if (dataset.SetGeoTransform(g) != CE_None) return false;
  if (!dem.frame.crs_wkt.empty()) {
    const OGRSpatialReference crs = spatial_reference(dem.frame.crs_wkt);
    if (dataset.SetSpatialRef(&crs) != CE_None) return false;
  }
  std::ostringstream origin;
  origin.precision(17);
  origin << dem.frame.origin.x() << ' ' << dem.frame.origin.y() << ' ' << dem.frame.origin.z();
  if (dataset.SetMetadataItem(kOriginItem, origin.str().c_str()) != CE_None) return false;
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

DemRaster raster_of(GDALDataset& dataset, const std::string& name, const std::optional<Eigen::Vector3d>& origin) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  GeoTransform g;
  if (dataset.GetGeoTransform(g) != CE_None) throw Error(name + ": the raster has no georeference");

  DemRaster dem{.rows = band.GetYSize(), .cols = band.GetXSize(), .cell_m = g[1]};
  dem.frame.crs_wkt = metric_crs(name, dataset.GetSpatialRef());
  check_placement(name, g);
  dem.frame.origin = origin.value_or(default_origin(dataset, g, band));
  dem.west_m = g[0] - dem.frame.origin.x();
  dem.north_m = g[3] - dem.frame.origin.y();
  dem.heights.resize(static_cast<std::size_t>(dem.rows) * dem.cols);
  BandReader reader(band, name, dem.frame.origin.z());
  for (int row = 0; row < dem.rows; ++row) reader.read_row(row, &dem.at(row, 0));
  return dem;
}

DemRaster read_dem(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin) {
  const QuietGdal quiet;
  return raster_of(*open_raster(file), file.string(), origin);
}

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

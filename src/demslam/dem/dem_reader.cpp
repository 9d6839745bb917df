#include "demslam/dem/dem_reader.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

using GeoTransform = double[6];  // GDAL's: x = g[0] + col g[1] + row g[2], y = g[3] + col g[4] + row g[5], cell corners

constexpr double kSmallestCell_m = 0.01;  // below: degrees that are taken for metres

void check_placement(const std::string& name, const GeoTransform& g) {
  if (g[2] != 0.0 || g[4] != 0.0) throw Error(name + ": the raster is rotated; reproject it north-up (gdalwarp)");
  if (!(g[1] > 0.0 && g[5] < 0.0)) throw Error(name + ": the raster is not north-up; reproject it (gdalwarp)");
  if (std::abs(g[1] + g[5]) > 1e-4 * g[1]) {
    throw Error(name + ": cells are not square (" + std::to_string(g[1]) + " x " + std::to_string(-g[5]) +
                "); resample the DEM (gdalwarp -tr)");
  }
}

/// Numbers that can only be longitudes and latitudes: cells below a centimetre, or once around the globe.
void check_metres(const std::string& name, const GeoTransform& g, int cols) {
  if (g[1] >= kSmallestCell_m && std::abs(g[1] * cols - 360.0) > 1e-6) return;
  throw Error(
      name + ": its cells of " + std::to_string(g[1]) +
      " look like degrees where metres are meant; assign the geographic CRS it has (gdal_edit -a_srs), then cut "
      "a part with 'demslam dem crop --center LON LAT --radius-m R'");
}

/// The horizontal CRS and the datum that the dataset states; no CRS leaves metres to the user's word.
LocalFrame frame_of(const std::string& name, GDALDataset& dataset) {
  LocalFrame frame;
  if (const char* item = dataset.GetMetadataItem(kHeightsItem)) {
    frame.heights = height_datum_named(item).value_or(HeightDatum::unstated);
  }
  const OGRSpatialReference* const stated = dataset.GetSpatialRef();
  if (stated == nullptr) return frame;
  OGRSpatialReference crs = *stated;
  if (crs.IsCompound()) {  // a vertical CRS beside the horizontal one: heights above a geoid
    if (frame.heights == HeightDatum::unstated) frame.heights = HeightDatum::geoid;
    crs.StripVertical();
  }
  if (crs.IsGeographic()) {
    throw Error(name +
                ": the DEM is in degrees, metres are needed; cut and reproject a part of it with "
                "'demslam dem crop --center LON LAT --radius-m R'");
  }
  if (std::abs(crs.GetLinearUnits() - 1.0) > 1e-9) {
    throw Error(name + ": the DEM's CRS is not in metres; reproject it (gdalwarp -t_srs)");
  }
  frame.crs_wkt = wkt_of(crs);
  return frame;
}

/// The origin the file itself names (write_dem does), else the centre of its extent.
Eigen::Vector3d default_origin(GDALDataset& dataset, const GeoTransform& g, GDALRasterBand& band) {
  if (const char* item = dataset.GetMetadataItem(kOriginItem)) {
    Eigen::Vector3d origin;
    std::istringstream numbers(item);
    if (numbers >> origin.x() >> origin.y() >> origin.z()) return origin;
  }
  return {g[0] + 0.5 * band.GetXSize() * g[1], g[3] + 0.5 * band.GetYSize() * g[5], band.GetOffset()};
}

DemRaster grid_of(GDALDataset& dataset, const std::string& name, const std::optional<Eigen::Vector3d>& origin) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  GeoTransform g;
  if (dataset.GetGeoTransform(g) != CE_None) throw Error(name + ": the raster has no georeference");
  DemRaster grid{.rows = band.GetYSize(), .cols = band.GetXSize(), .cell_m = g[1]};
  grid.frame = frame_of(name, dataset);
  check_placement(name, g);
  check_metres(name, g, grid.cols);
  grid.frame.origin = origin.value_or(default_origin(dataset, g, band));
  grid.west_m = g[0] - grid.frame.origin.x();
  grid.north_m = g[3] - grid.frame.origin.y();
  return grid;
}

/// Heights of one band: value * scale + offset - height of the origin; NaN where GDAL's mask says no-data.
class BandReader {
 public:
  BandReader(GDALRasterBand& band, std::string name, double origin_height_m)
      : band_(band), name_(std::move(name)), scale_(band.GetScale()), offset_(band.GetOffset() - origin_height_m) {}

  void read(const CellWindow& w, float* heights) {
    for (int row = w.row; row < w.row + w.rows; ++row, heights += w.cols) read_row(row, w, heights);
  }

 private:
  void read_row(int row, const CellWindow& w, float* heights) {
    values_.resize(w.cols);
    valid_.resize(w.cols);
    GDALRasterBand& mask = *band_.GetMaskBand();
    if (band_.RasterIO(GF_Read, w.col, row, w.cols, 1, values_.data(), w.cols, 1, GDT_Float64, 0, 0) != CE_None ||
        mask.RasterIO(GF_Read, w.col, row, w.cols, 1, valid_.data(), w.cols, 1, GDT_Byte, 0, 0) != CE_None) {
      throw Error(name_ + ": row " + std::to_string(row) + " cannot be read: " + QuietGdal::message());
    }
    for (int col = 0; col < w.cols; ++col) {
      heights[col] = valid_[col] == 0 ? std::numeric_limits<float>::quiet_NaN()
                                      : static_cast<float>(values_[col] * scale_ + offset_);
    }
  }

  GDALRasterBand& band_;
  std::string name_;
  double scale_, offset_;
  std::vector<double> values_;
  std::vector<unsigned char> valid_;
};

DemRaster part_of(const DemRaster& grid, const CellWindow& w) {
  DemRaster part{.rows = w.rows, .cols = w.cols, .cell_m = grid.cell_m};
  part.west_m = grid.west_m + w.col * grid.cell_m;
  part.north_m = grid.north_m - w.row * grid.cell_m;
  part.frame = grid.frame;
  part.heights.resize(static_cast<std::size_t>(w.rows) * w.cols);
  return part;
}

}  // namespace

struct DemReader::Source {
  GdalDataset dataset;
  DemRaster grid;
  BandReader band;
};

DemReader::DemReader(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin) {
  const QuietGdal quiet;
  GdalDataset dataset = open_raster(file);
  DemRaster grid = grid_of(*dataset, file.string(), origin);
  BandReader band(*dataset->GetRasterBand(1), file.string(), grid.frame.origin.z());
  source_ = std::make_unique<Source>(Source{std::move(dataset), std::move(grid), std::move(band)});
}

DemReader::~DemReader() = default;
DemReader::DemReader(DemReader&&) noexcept = default;

const DemRaster& DemReader::grid() const { return source_->grid; }

void DemReader::read(const CellWindow& window, float* heights) {
  const QuietGdal quiet;
  source_->band.read(window, heights);
}

DemRaster DemReader::read(const CellWindow& window) {
  DemRaster part = part_of(source_->grid, window);
  read(window, part.heights.data());
  return part;
}

DemRaster raster_of(GDALDataset& dataset, const std::string& name, const std::optional<Eigen::Vector3d>& origin) {
  const DemRaster grid = grid_of(dataset, name, origin);
  const CellWindow all{0, 0, grid.rows, grid.cols};
  DemRaster dem = part_of(grid, all);
  BandReader(*dataset.GetRasterBand(1), name, grid.frame.origin.z()).read(all, dem.heights.data());
  return dem;
}

DemRaster read_dem(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin) {
  DemReader reader(file, origin);
  return reader.read({0, 0, reader.grid().rows, reader.grid().cols});
}

DemRaster read_dem(const std::filesystem::path& file, const MapWindow& window) {
  DemReader reader(file);
  return reader.read(cells_in(reader.grid(), window));
}

}  // namespace demslam

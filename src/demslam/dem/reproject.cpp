#include "demslam/dem/reproject.h"

#include <gdal_utils.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

OGRSpatialReference projection_at(const OGRSpatialReference& source, const LocalCut& cut) {
  OGRSpatialReference local;
  local.SetProjCS("Local transverse Mercator");
  local.CopyGeogCSFrom(&source);
  local.SetTM(cut.lat_deg, cut.lon_deg, 1.0, 0.0, 0.0);
  local.SetLinearUnits("metre", 1.0);
  return local;
}

/// gdalwarp's arguments: a whole number of cells either side of the centre.
std::vector<std::string> warp_arguments(const std::string& wkt, const LocalCut& cut) {
  const std::string cell = std::to_string(cut.cell_m);
  const double half_m = std::max(1.0, std::round(cut.radius_m / cut.cell_m)) * cut.cell_m;
  const std::string low = std::to_string(-half_m), high = std::to_string(half_m);
  return {"-of", "MEM", "-t_srs", wkt,  "-te",   low,   low,       high,         high,
          "-tr", cell,  cell,     "-r", "cubic", "-ot", "Float64", "-dstnodata", "nan"};
}

GdalDataset warp(GDALDataset& source, const std::string& wkt, const LocalCut& cut) {
  const std::vector<std::string> arguments = warp_arguments(wkt, cut);
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  GDALWarpAppOptions* const options = GDALWarpAppOptionsNew(argv.data(), nullptr);
  GDALDatasetH sources[] = {&source};
  GdalDataset warped(GDALDataset::FromHandle(GDALWarp("", nullptr, 1, sources, options, nullptr)));
  GDALWarpAppOptionsFree(options);
  return warped;
}

}  // namespace

DemRaster read_dem_around(const std::filesystem::path& file, const LocalCut& cut) {
  const QuietGdal quiet;
  if (!(cut.cell_m > 0.0 && cut.radius_m > 0.0)) throw Error("DEM cut: radius and cell size must be positive");
  const GdalDataset source = open_raster(file);
  const OGRSpatialReference* const crs = source->GetSpatialRef();
  if (crs == nullptr)
    throw Error(file.string() + ": no CRS, so it cannot be reprojected; assign one (gdal_edit -a_srs)");
  const std::string wkt = wkt_of(projection_at(*crs, cut));
  const GdalDataset warped = warp(*source, wkt, cut);
  if (!warped) throw Error(file.string() + ": cannot be reprojected: " + QuietGdal::message());

  GDALRasterBand& from = *source->GetRasterBand(1);
  GDALRasterBand& to = *warped->GetRasterBand(1);
  to.SetScale(from.GetScale());
  to.SetOffset(from.GetOffset());
  DemRaster dem = raster_of(*warped, file.string(), Eigen::Vector3d(0.0, 0.0, from.GetOffset()));
  if (std::all_of(dem.heights.begin(), dem.heights.end(), [](float h) { return std::isnan(h); })) {
    throw Error(file.string() + ": no data within " + std::to_string(cut.radius_m) + " m of longitude " +
                std::to_string(cut.lon_deg) + ", latitude " + std::to_string(cut.lat_deg));
  }
  return dem;
}

}  // namespace demslam

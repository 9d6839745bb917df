#include "demslam/dem/reproject.h"

#include <gdal_utils.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "demslam/dem/internal/gdal_support.h"

namespace demslam {
namespace {

/// `scale`: that of the terrain's height, so that map metres are metres on the ground.
OGRSpatialReference projection_at(const OGRSpatialReference& source, const LocalCut& cut, double scale) {
  OGRSpatialReference local;
  local.SetProjCS("Local transverse Mercator");
  local.CopyGeogCSFrom(&source);
  local.SetTM(cut.lat_deg, cut.lon_deg, scale, 0.0, 0.0);
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

/// Band 1 in the given projection around its origin.
DemRaster cut_out(GDALDataset& source, const std::string& name, const LocalCut& cut, const OGRSpatialReference& crs) {
  const GdalDataset warped = warp(source, wkt_of(crs), cut);
  if (!warped) throw Error(name + ": cannot be reprojected: " + QuietGdal::message());
  GDALRasterBand &from = *source.GetRasterBand(1), &to = *warped->GetRasterBand(1);
  to.SetScale(from.GetScale());
  to.SetOffset(from.GetOffset());
  return raster_of(*warped, name, Eigen::Vector3d(0.0, 0.0, from.GetOffset()));
}

double mean_height_m(const DemRaster& dem, const std::string& name, const LocalCut& cut) {
  double sum = 0.0;
  std::size_t cells = 0;
  for (const float height : dem.heights) {
    if (!std::isfinite(height)) continue;
    sum += height;
    ++cells;
  }
  if (cells > 0) return sum / static_cast<double>(cells) + dem.frame.origin.z();
  throw Error(name + ": no data within " + std::to_string(cut.radius_m) + " m of longitude " +
              std::to_string(cut.lon_deg) + ", latitude " + std::to_string(cut.lat_deg));
}

/// How much longer a metre of the reference body is at a height above it. Radii count from its centre.
double scale_at(double height_m, double semi_major_m) {
  const bool radius = height_m > 0.5 * semi_major_m;
  return (radius ? height_m : semi_major_m + height_m) / semi_major_m;
}

}  // namespace

DemRaster read_dem_around(const std::filesystem::path& file, const LocalCut& cut) {
  const QuietGdal quiet;
  if (!(cut.cell_m > 0.0 && cut.radius_m > 0.0)) throw Error("DEM cut: radius and cell size must be positive");
  const GdalDataset source = open_raster(file);
  const OGRSpatialReference* const stated = source->GetSpatialRef();
  if (stated == nullptr)
    throw Error(file.string() + ": no CRS, so it cannot be reprojected; assign one (gdal_edit -a_srs)");
  OGRSpatialReference crs = *stated;
  crs.StripVertical();
  const DemRaster unscaled = cut_out(*source, file.string(), cut, projection_at(crs, cut, 1.0));
  const double scale = scale_at(mean_height_m(unscaled, file.string(), cut), crs.GetSemiMajor());
  DemRaster dem = cut_out(*source, file.string(), cut, projection_at(crs, cut, scale));
  dem.frame.heights = stated->IsCompound() ? HeightDatum::geoid : unscaled.frame.heights;
  return dem;
}

}  // namespace demslam

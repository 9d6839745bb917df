#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "demslam/base/progress.h"
#include "demslam/dem/dem_builder.h"
#include "demslam/geometry/pose.h"

namespace demslam {

enum class CloudKind {
  lidar,   ///< LiDAR/<stamp>.txt of a dataset
  depth,   ///< image0/depth/<stamp>.pfm of a dataset, in its left camera
  points,  ///< a point file in the map frame (PLY as `demslam map export` writes it, or x y z)
};

/// What a DEM is made of. Where the poses come from is for the user to say: the truth, a LiDAR's own log, or a run.
struct BuildDemInputs {
  CloudKind kind = CloudKind::lidar;
  std::filesystem::path source;                  ///< dataset folder, or point file
  std::filesystem::path poses;                   ///< trajectory file; not for points
  std::filesystem::path calibration;             ///< depth: replaces the dataset's own
  std::optional<Eigen::Vector3d> p_body_sensor;  ///< lidar: the poses are the body's, the sensor sits there, level
  std::optional<std::filesystem::path> like;     ///< a DEM whose CRS, origin and datum are the map's
  double max_range_m = 30.0;
  bool without_rocks = false;  ///< lidar: leave out LuSNAR's category 174
  int pixel_step = 4;          ///< depth: every so many columns and rows
};

struct DemBuildReport {
  BuiltDem dem;
  std::size_t scans = 0, without_pose = 0;
  bool world_z_down = false;  ///< the lidar's poses had their z downwards (its points lay above it) and were turned
};

/// Rasterises every scan at its pose. Lidar poses are the sensor's in the world, as LuSNAR's LiDAR/timestamp.txt,
/// unless `p_body_sensor` is given; depth poses are the body's, as a truth or a run's trajectory.tum has them. A scan
/// without a pose within 5 ms of its stamp is left out and counted. Throws Error when nothing remains.
DemBuildReport build_dem(const BuildDemInputs& inputs, const DemBuildOptions& options, const Progress& progress);

/// The three rasters: "dem.tif", "dem_sigma.tif", "dem_count.tif".
void write_built_dem(const std::filesystem::path& file, const BuiltDem& dem);

}  // namespace demslam

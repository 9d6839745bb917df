#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/evaluation/association.h"
#include "demslam/evaluation/truth.h"

namespace demslam {

struct ExportInputs {
  std::filesystem::path run_or_trajectory;
  std::optional<std::filesystem::path> truth;  ///< without one: the dataset's, if it has one
  std::filesystem::path output;                ///< a folder, made where missing
  double max_difference_s = 0.01;              ///< stamps further apart do not pair
  TruthOptions options;                        ///< `dem`: also for the geographic files; default: the run's own
};

/// Writes a result for other programs: trajectory.tum; trajectory_kitti.txt with times.txt; trajectory_euroc.csv; with
/// a DEM that has a CRS trajectory.geojson and trajectory.kml; with a truth truth.tum and, given a DEM, error.tif (on
/// its grid, mean distance from the truth of the poses in each cell, unaligned) and the truth's geographic tracks.
/// Returns the files. Throws Error.
std::vector<std::filesystem::path> export_run(const ExportInputs& inputs);

/// Mean position error in each cell of `grid` (its heights are not read); holes where no pose is.
DemRaster error_raster(DemRaster grid, const PosePairs& pairs);

}  // namespace demslam

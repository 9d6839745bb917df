#pragma once

#include <filesystem>

#include "demslam/experiment/study.h"

namespace demslam {

/// Pictures of what run_study() has left in `out`, for each drive with its first seed:
///   DRIVE_map.png    the variants' tracks over the DEM
///   DRIVE_error.svg  position error over distance, without alignment
///   DRIVE_cost.svg   milliseconds per frame and resident memory of the recording over distance
/// A drive that is not finished has none.
void write_study_figures(const Study& study, const std::filesystem::path& out);

}  // namespace demslam

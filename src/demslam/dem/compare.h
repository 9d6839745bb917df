#pragma once

#include <cstddef>
#include <filesystem>

#include "demslam/dem/dem.h"

namespace demslam {

/// How two DEMs differ, a - b.
struct DemComparison {
  DemRaster difference;   ///< on a's grid; holes where either has one; its origin's height is 0
  std::size_t cells = 0;  ///< compared
  double mean_m = 0.0, median_m = 0.0, rms_m = 0.0, std_m = 0.0;
  double nmad_m = 0.0;  ///< 1.4826 * median absolute deviation from the median: the sigma of normal errors
  double min_m = 0.0, max_m = 0.0;
  double p95_m = 0.0;  ///< of the absolute difference
};

/// Both in one map frame; b is interpolated (bilinear) at a's cell centres. Throws Error when no cell has both.
DemComparison compare(const DemRaster& a, const DemRaster& b);

/// Reads two DEMs into a's map frame. Throws Error when their CRS differ, or what their heights count from.
DemComparison compare_dems(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace demslam

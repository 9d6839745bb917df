#pragma once

#include "demslam/slam/backend.h"

namespace demslam::apps {

/// What a drive has found out about its DEM, a line each: where it lies, how noisy it is.
void print_dem_findings(const SlamResult& result);

}  // namespace demslam::apps

#pragma once

#include <string>

namespace gtsam {
class NonlinearFactor;
}

namespace demslam {

/// What a factor measures: "dem_height", "dem_normal", "terrain_patch", "sun" (or any direction), "skyline", "prior"
/// (on a pose: the start, a terrain fix, an earlier map). Empty for odometry, loops and systematic errors.
std::string factor_kind(const gtsam::NonlinearFactor& factor);

}  // namespace demslam

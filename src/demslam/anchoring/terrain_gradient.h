#pragma once

namespace demslam {

/// Which derivatives of the terrain a factor shows the optimiser. `vertical_only` is the published form: the height
/// moves only the pose's z (and the normal only its attitude); `full` lets the slope correct the horizontal position
/// too.
enum class TerrainGradient { full, vertical_only };

}  // namespace demslam

#pragma once

#include "demslam/anchoring/anchor.h"
#include "demslam/features/frontend.h"
#include "demslam/graph/loop_closure.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/odometry/odometry.h"
#include "demslam/slam/landmarks.h"

namespace demslam {

/// Everything that changes what a run computes. Defaults are the recommended settings; no file is needed to run.
struct SlamOptions {
  FrontendOptions frontend;
  OdometryOptions odometry;
  /// Without a DEM or the sun nothing tells the systematic errors; their states then keep the covariance true.
  PoseGraphOptions graph{.systematic = {.enabled = true}};
  LoopOptions loops;
  AnchoringOptions anchoring{.filter_dem = true,
                             .estimate_noise = true,
                             .patches = true,
                             .sigma_bias_m = 1.0,
                             .sigma_shift_m = 1.0,
                             .vague_start_m = 3.0};
  LandmarkOptions landmarks;  ///< for terrain patches

  bool use_loops = true;  ///< false: --no-loops
  bool use_dem = true;    ///< false: --no-dem; without a DEM nothing changes
  bool use_sun = true;    ///< sun directions of the dataset's sun.csv
  /// Optimisation in the run (graph.window_m of path, at a cost that does not grow), besides those after a loop; the
  /// one at the end is a batch.
  int optimize_every_keyframes = 10;
};

}  // namespace demslam

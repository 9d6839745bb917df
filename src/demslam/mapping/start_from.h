#pragma once

#include "demslam/dataset/start_pose.h"
#include "demslam/geometry/trajectory.h"

namespace demslam {

struct StartFromOptions {
  double heading_path_m = 3.0;  ///< without orientations: the heading is that of the way to a position so far off
  double sigma_position_m = 0.1;
  double sigma_rotation_deg = 0.0;  ///< 0: 0.1 with orientations, 5 without (roll and pitch are then taken as level)
};

/// What a mission knows of its first pose, from poses or positions in the map: that at `t_ns`, interpolated. Throws
/// Error when the track does not reach over that time, or stands still where a heading is needed.
StartPose start_from(const Trajectory& track, TimestampNs t_ns, const StartFromOptions& options);

}  // namespace demslam

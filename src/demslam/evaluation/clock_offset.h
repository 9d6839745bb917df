#pragma once

#include "demslam/geometry/trajectory.h"

namespace demslam {

struct ClockOffset {
  double offset_s = 0.0;  ///< to add to the estimate's stamps (AssociationOptions::offset_s)
  double rmse_m = 0.0;    ///< SE(3)-aligned position error at that offset
};

/// The clock offset that makes the SE(3)-aligned estimate agree best with the truth, whose positions are interpolated
/// linearly: a scan over +-`range_s`, refined to a millisecond. The motion must turn: on a straight line at constant
/// speed no offset can be told from another. Throws Error when the trajectories never overlap or lie on a line.
ClockOffset estimate_clock_offset(const Trajectory& truth, const Trajectory& estimate, double range_s = 30.0);

}  // namespace demslam

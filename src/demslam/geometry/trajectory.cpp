#include "demslam/geometry/trajectory.h"

namespace demslam {

double path_length_m(const Trajectory& trajectory) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length_m += (trajectory[i].pose.translation() - trajectory[i - 1].pose.translation()).norm();
  }
  return length_m;
}

}  // namespace demslam

#include <algorithm>

#include "demslam/report/internal/distance_axis.h"

namespace demslam {

DistanceAxis::DistanceAxis(const ReportRun& run) {
  if (run.evaluation) {
    for (const PoseError& error : run.evaluation->errors) knots_.emplace_back(error.t_ns, error.distance_m);
    return;
  }
  for (std::size_t i = 0; i < run.trajectory.size(); ++i) {
    const double step_m =
        i == 0 ? 0.0 : (run.trajectory[i].pose.translation() - run.trajectory[i - 1].pose.translation()).norm();
    knots_.emplace_back(run.trajectory[i].t_ns, length_m() + step_m);
  }
}

double DistanceAxis::at(TimestampNs t_ns) const {
  const auto after = std::lower_bound(knots_.begin(), knots_.end(), t_ns,
                                      [](const auto& knot, TimestampNs t) { return knot.first < t; });
  if (after == knots_.end()) return length_m();
  if (after == knots_.begin()) return after->second;
  const auto& [t0, d0] = *std::prev(after);
  const double share = static_cast<double>(t_ns - t0) / static_cast<double>(after->first - t0);
  return d0 + share * (after->second - d0);
}

}  // namespace demslam

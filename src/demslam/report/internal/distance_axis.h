#pragma once

#include <utility>
#include <vector>

#include "demslam/report/run_report.h"

namespace demslam {

/// Distance driven at a time, metres: along the truth where the run was evaluated, else along the run's own track.
/// Linear between the poses, constant before the first and after the last one.
class DistanceAxis {
 public:
  explicit DistanceAxis(const ReportRun& run);
  double at(TimestampNs t_ns) const;
  double length_m() const { return knots_.empty() ? 0.0 : knots_.back().second; }

 private:
  std::vector<std::pair<TimestampNs, double>> knots_;
};

}  // namespace demslam

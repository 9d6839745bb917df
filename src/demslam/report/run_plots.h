#pragma once

#include <string>

#include "demslam/report/run_report.h"

namespace demslam {

// SVG documents over the distance driven.

/// Position error of every run that was evaluated, without alignment, on a logarithmic axis.
std::string error_plot(const Report& report, const std::string& title);
/// A run's milliseconds per frame and resident memory, means over hundredths of its frames.
std::string cost_plot(const ReportRun& run, const std::string& title);

}  // namespace demslam

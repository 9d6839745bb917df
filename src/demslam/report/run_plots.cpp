#include "demslam/report/run_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "demslam/report/internal/distance_axis.h"
#include "demslam/report/internal/run_colours.h"
#include "demslam/report/svg_plot.h"

namespace demslam {
namespace {

constexpr std::size_t kErrors = 1000, kCosts = 100;  // points of a line
constexpr double kLeastShown_m = 0.01;               // the start's error would stretch the axis

std::string css_colour(std::size_t run) {
  const Colour colour = run_colour(run);
  return fmt::format("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue);
}

PlotSeries costs(const ReportRun& run, const std::string& column, const std::string& label, std::size_t colour) {
  PlotSeries series{label, css_colour(colour), {}};
  const auto found = std::ranges::find(run.timings, column, &Column::name);
  if (found == run.timings.end()) return series;
  const DistanceAxis distance(run);
  const std::size_t frames = std::min(found->values.size(), run.frames.size());
  const std::size_t stretch = std::max<std::size_t>(1, frames / kCosts);
  for (std::size_t begin = 0; begin + stretch <= frames; begin += stretch) {
    const auto first = found->values.begin() + static_cast<std::ptrdiff_t>(begin);
    const double sum = std::accumulate(first, first + static_cast<std::ptrdiff_t>(stretch), 0.0);
    series.points.emplace_back(distance.at(run.frames[begin + stretch / 2].t_ns), sum / static_cast<double>(stretch));
  }
  return series;
}

}  // namespace

std::string error_plot(const Report& report, const std::string& title) {
  LinePlot plot{.title = title, .x_label = "distance [m]", .y_label = "position error [m]", .log_y = true};
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    const ReportRun& run = report.runs[i];
    if (!run.evaluation) continue;
    PlotSeries& series = plot.series.emplace_back(PlotSeries{run.name, css_colour(i), {}});
    const std::vector<PoseError>& errors = run.evaluation->errors;
    for (std::size_t k = 0; k < errors.size(); k += 1 + errors.size() / kErrors)
      series.points.emplace_back(errors[k].distance_m, std::max(errors[k].error_m.norm(), kLeastShown_m));
  }
  return to_svg(plot);
}

std::string cost_plot(const ReportRun& run, const std::string& title) {
  return to_svg({.title = title,
                 .x_label = "distance [m]",
                 .y_label = "ms, MiB",
                 .series = {costs(run, "total_ms", "per frame [ms]", 0), costs(run, "rss_mib", "memory [MiB]", 1)}});
}

}  // namespace demslam

#include "demslam/experiment/study_figures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/base/text.h"
#include "demslam/report/run_report.h"
#include "demslam/report/svg_plot.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// Okabe-Ito, as the map's tracks.
constexpr std::array kColours{"#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00"};
constexpr std::size_t kPoints = 500;  ///< of a line

constexpr double kLeastShown_m = 0.01;  ///< the start's error would stretch the axis

/// Every n-th of `count`, at most kPoints.
std::size_t stride_of(std::size_t count) { return std::max<std::size_t>(1, count / kPoints); }

std::string error_plot(const Report& report, const std::string& title) {
  LinePlot plot{.title = title, .x_label = "distance [m]", .y_label = "position error [m]", .log_y = true};
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    PlotSeries& series = plot.series.emplace_back(PlotSeries{report.runs[i].name, kColours[i % kColours.size()], {}});
    const std::vector<PoseError>& errors = report.runs[i].evaluation->errors;
    for (std::size_t k = 0; k < errors.size(); k += stride_of(errors.size()))
      series.points.emplace_back(errors[k].distance_m, std::max(errors[k].error_m.norm(), kLeastShown_m));
  }
  return to_svg(plot);
}

/// Means over equal stretches of the run; frames are evenly spaced by distance up to stops and turns.
PlotSeries cost_of(const Columns& timings, const std::string& column, const std::string& label, const char* colour,
                   double length_m) {
  PlotSeries series{label, colour, {}};
  const auto found = std::ranges::find(timings, column, &Column::name);
  if (found == timings.end()) return series;
  const std::vector<float>& values = found->values;
  const std::size_t stride = std::max<std::size_t>(1, values.size() / 100);
  for (std::size_t begin = 0; begin + stride <= values.size(); begin += stride) {
    double sum = 0.0;
    for (std::size_t k = begin; k < begin + stride; ++k) sum += values[k];
    const double share =
        (static_cast<double>(begin) + 0.5 * static_cast<double>(stride)) / static_cast<double>(values.size());
    series.points.emplace_back(share * length_m, sum / static_cast<double>(stride));
  }
  return series;
}

std::string cost_plot(const ReportRun& recording, const std::string& title) {
  const double length_m =
      recording.evaluation ? recording.evaluation->path_length_m : path_length_m(recording.trajectory);
  return to_svg({.title = title,
                 .x_label = "distance [m]",
                 .y_label = "ms, MiB",
                 .series = {cost_of(recording.timings, "total_ms", "per frame [ms]", kColours[0], length_m),
                            cost_of(recording.timings, "rss_mib", "memory [MiB]", kColours[1], length_m)}});
}

}  // namespace

void write_study_figures(const Study& study, const fs::path& out) {
  for (const StudyDrive& drive : study.drives) {
    const fs::path folder = study_folder(out, drive, study.seeds.front());
    std::vector<fs::path> runs;
    for (const StudyVariant& variant : study.variants) {
      if (fs::exists(folder / variant.name / "summary.json")) runs.push_back(folder / variant.name);
    }
    if (runs.size() < study.variants.size()) continue;
    const Report report = read_report(runs, std::nullopt, folder / "data" / "dem.tif");
    write_map_picture(report, out / (drive.name + "_map.png"));
    write_text(out / (drive.name + "_error.svg"), error_plot(report, study.title + ": error, no alignment"));
    const Report recording = read_report({folder / "recording"}, std::nullopt, std::nullopt);
    write_text(out / (drive.name + "_cost.svg"), cost_plot(recording.runs.front(), study.title + ": cost of odometry"));
  }
}

}  // namespace demslam

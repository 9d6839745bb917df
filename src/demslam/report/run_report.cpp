#include "demslam/report/run_report.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/evaluation/runs.h"
#include "demslam/evaluation/table.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/report/map_picture.h"
#include "demslam/report/svg_plot.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// Okabe-Ito colours, told apart by colour-blind readers too.
struct NamedColour {
  Colour rgb;
  const char* css;
};
constexpr std::array<NamedColour, 5> kRunColours{{{{213, 94, 0}, "#d55e00"},
                                                  {{0, 114, 178}, "#0072b2"},
                                                  {{0, 158, 115}, "#009e73"},
                                                  {{204, 121, 167}, "#cc79a7"},
                                                  {{230, 159, 0}, "#e69f00"}}};
constexpr Colour kTruthColour{250, 250, 250};

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

nlohmann::json read_summary(const fs::path& run) {
  const auto json = nlohmann::json::parse(read_text(run / "summary.json"), nullptr, false);
  if (json.is_discarded()) throw Error(run.string() + ": no run folder (summary.json is missing or broken)");
  return json;
}

std::string label_of(const ReportRun& run) {
  if (!run.evaluation) return run.name;
  return fmt::format("{}: ATE {:.2f} m, no alignment", run.name, run.evaluation->ate.rmse);
}

std::optional<fs::path> dem_of(const fs::path& run) {
  const auto inputs = read_summary(run)["inputs"];
  if (inputs.contains("dem")) return fs::path(inputs["dem"]["path"].get<std::string>());
  return std::nullopt;
}

ReportRun read_run(const fs::path& folder, const std::optional<fs::path>& truth) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  ReportRun run{.name = path.has_filename() ? path.filename().string() : path.parent_path().filename().string()};
  run.trajectory = read_trajectory(folder / "trajectory.tum").poses;
  if (truth) run.evaluation = evaluate_run(folder, truth, {});
  return run;
}

std::vector<MapTrack> tracks_of(const Report& report) {
  std::vector<MapTrack> tracks;
  if (report.truth) tracks.push_back({"truth", kTruthColour, *report.truth});
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    tracks.push_back({label_of(report.runs[i]), kRunColours[i % kRunColours.size()].rgb, report.runs[i].trajectory});
  }
  return tracks;
}

Canvas map_of(const Report& report) {
  if (!report.dem) throw Error("report: no run was anchored to a DEM; name one with --dem to draw the map");
  return draw_map_picture(Dem(read_dem(*report.dem)), tracks_of(report), {});
}

std::string base64(const std::string& bytes) {
  static const char* const kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned int word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::string map_element(const Report& report) {
  if (!report.dem) return "";
  return "<figure><img alt=\"tracks over the shaded elevation model\" src=\"data:image/png;base64," +
         base64(map_of(report).png()) + "\"><figcaption>Tracks over the shaded DEM, North up.</figcaption></figure>\n";
}

std::string table_element(const Report& report) {
  std::vector<NamedEvaluation> evaluations;
  for (const ReportRun& run : report.runs) {
    if (run.evaluation) evaluations.emplace_back(run.name, *run.evaluation);
  }
  if (evaluations.empty()) return "<p>No ground truth: nothing to evaluate.</p>\n";
  const Table table = evaluation_table(evaluations);
  std::string html = "<h2>" + table.title + "</h2>\n<div class=\"wide\"><table><tr>";
  for (const std::string& cell : table.header) html += "<th>" + cell + "</th>";
  for (const auto& row : table.rows) {
    html += "</tr>\n<tr>";
    for (const std::string& cell : row) html += "<td>" + cell + "</td>";
  }
  return html + "</tr></table></div>\n";
}

std::string error_plot(const Report& report, const std::string& title, double (*part)(const Eigen::Vector3d&)) {
  LinePlot plot{.title = title, .x_label = "distance driven [m]", .y_label = "error [m]"};
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    if (!report.runs[i].evaluation) continue;
    PlotSeries series{report.runs[i].name, kRunColours[i % kRunColours.size()].css, {}};
    for (const PoseError& e : report.runs[i].evaluation->errors)
      series.points.emplace_back(e.distance_m, part(e.error_m));
    plot.series.push_back(std::move(series));
  }
  return plot.series.empty() ? "" : to_svg(plot);
}

constexpr const char* kStyle = R"(<style>
:root{color-scheme:light dark;--ink:#1c1c22;--paper:#fff;--line:#ccc}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8ee;--paper:#15161a;--line:#444}}
body{font:16px/1.5 system-ui,sans-serif;max-width:960px;margin:2rem auto;padding:0 1rem;color:var(--ink);background:var(--paper)}
img,svg{width:100%;height:auto}figure{margin:0}.wide{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}th,td{padding:.25rem .75rem;text-align:right;border-bottom:1px solid var(--line)}
th:first-child,td:first-child{text-align:left}
.plot text{font-size:12px;fill:var(--ink)}.plot .title{font-size:15px;font-weight:600}.plot .legend{fill:inherit}.plot .grid{stroke:var(--line)}
pre{overflow-x:auto;font-size:12px}
</style>)";

std::string escaped(const std::string& text) {
  std::string html;
  for (const char c : text) {
    if (c == '<')
      html += "&lt;";
    else if (c == '&')
      html += "&amp;";
    else
      html += c;
  }
  return html;
}

}  // namespace

Report read_report(const std::vector<fs::path>& runs, const std::optional<fs::path>& truth,
                   const std::optional<fs::path>& dem) {
  Report report{.dem = dem};
  for (const fs::path& run : runs) {
    const auto true_file = truth ? truth : find_truth(run);
    if (true_file && !report.truth) report.truth = read_trajectory(*true_file).poses;
    report.runs.push_back(read_run(run, true_file));
    if (!report.dem) report.dem = dem_of(run);
  }
  report.summary = read_text(runs.front() / "summary.json");
  return report;
}

void write_map_picture(const Report& report, const fs::path& file) { map_of(report).write(file); }

void write_html(const Report& report, const fs::path& file) {
  std::string html =
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>demslam report</title>";
  html += std::string(kStyle) + "</head><body><h1>demslam report</h1>\n" + map_element(report) + table_element(report);
  html += error_plot(report, "Horizontal error", [](const Eigen::Vector3d& e) { return e.head<2>().norm(); });
  html += error_plot(report, "Vertical error", [](const Eigen::Vector3d& e) { return std::abs(e.z()); });
  html += "<h2>Run</h2><details><summary>summary.json of the first run</summary><pre>" + escaped(report.summary) +
          "</pre></details></body></html>\n";
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << html;
  if (!stream.flush()) throw Error(file.string() + ": cannot be written (disk full, or the folder is not writable)");
}

}  // namespace demslam

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "demslam/evaluation/markdown.h"
#include "demslam/experiment/terrain_experiment.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

std::string metres(double value) { return fmt::format("{:.2f}", value); }

void add_once(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

/// Median errors: a row per estimator, a column per scene.
Table overview(const std::vector<ExperimentRow>& rows) {
  std::vector<std::string> scenes, estimators;
  for (const ExperimentRow& row : rows) {
    add_once(scenes, row.scene);
    add_once(estimators, row.estimator);
  }
  Table table{.title = "Median ATE [m], unaligned", .header = {"estimator"}};
  table.header.insert(table.header.end(), scenes.begin(), scenes.end());
  for (const std::string& estimator : estimators) {
    std::vector<std::string> cells = {estimator};
    for (const std::string& scene : scenes) {
      const auto row = std::find_if(rows.begin(), rows.end(), [&](const ExperimentRow& r) {
        return r.scene == scene && r.estimator == estimator;
      });
      cells.push_back(row == rows.end() ? "" : metres(row->median_ate_m));
    }
    table.rows.push_back(cells);
  }
  return table;
}

std::string titled(const Table& table) { return table.title + "\n\n" + markdown_table(table); }

}  // namespace

Table experiment_table(const std::vector<ExperimentRow>& rows) {
  Table table{.title = "Errors unaligned, NEES of the position per degree of freedom",
              .header = {"scene", "estimator", "seeds", "ATE median [m]", "ATE worst [m]", "horizontal [m]",
                         "vertical [m]", "end [m]", "NEES mean", "NEES median", "NEES worst", "NEES 95 % band"}};
  for (const ExperimentRow& r : rows) {
    table.rows.push_back({r.scene, r.estimator, std::to_string(r.seeds), metres(r.median_ate_m), metres(r.worst_ate_m),
                          metres(r.median_horizontal_m), metres(r.median_vertical_m), metres(r.median_end_m),
                          metres(r.mean_nees), metres(r.median_nees), metres(r.worst_nees),
                          fmt::format("{:.2f} to {:.2f}", r.nees_low, r.nees_high)});
  }
  return table;
}

Table timing_table(const std::vector<ExperimentRow>& rows) {
  Table table{.title = "Milliseconds per keyframe while driving", .header = {"scene", "estimator", "median [ms]"}};
  for (const ExperimentRow& r : rows) {
    table.rows.push_back({r.scene, r.estimator, fmt::format("{:.2f}", r.median_ms_per_keyframe)});
  }
  return table;
}

std::string experiment_markdown(const std::vector<ExperimentRow>& rows) {
  return titled(overview(rows)) + "\n" + titled(experiment_table(rows));
}

std::string experiment_json(const std::vector<ExperimentRow>& rows) {
  Json all = Json::array();
  for (const ExperimentRow& r : rows) {
    all.push_back({{"scene", r.scene},
                   {"estimator", r.estimator},
                   {"seeds", r.seeds},
                   {"median_ate_m", r.median_ate_m},
                   {"worst_ate_m", r.worst_ate_m},
                   {"median_horizontal_m", r.median_horizontal_m},
                   {"median_vertical_m", r.median_vertical_m},
                   {"median_end_m", r.median_end_m},
                   {"mean_nees", r.mean_nees},
                   {"median_nees", r.median_nees},
                   {"worst_nees", r.worst_nees},
                   {"nees_band_95", {r.nees_low, r.nees_high}}});
  }
  return all.dump(1) + "\n";
}

}  // namespace demslam

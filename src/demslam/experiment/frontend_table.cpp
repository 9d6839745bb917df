#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "demslam/experiment/frontend_experiment.h"

namespace demslam {
namespace {

std::string three(const double (&values)[3]) {
  return fmt::format("{:.0f} / {:.0f} / {:.0f}", values[0], values[1], values[2]);
}

std::vector<std::string> cells(const FrontendRow& r) {
  std::vector<std::string> row{r.group,
                               r.frontend,
                               std::to_string(r.pairs),
                               fmt::format("{:.0f}", r.points),
                               fmt::format("{:.0f}", r.matches),
                               fmt::format("{:.0f} ± {:.0f}", r.right, r.right_95),
                               fmt::format("{:.1f}", r.precision),
                               fmt::format("{:.1f}", r.on_row)};
  const auto of_truth = [&](std::string text) { row.push_back(r.has_truth ? std::move(text) : "-"); };
  of_truth(three(r.angle_auc));
  of_truth(three(r.offset_auc));
  of_truth(fmt::format("{:.0f}", r.recall));
  of_truth(std::to_string(r.wrong));
  for (const std::string& text :
       {std::to_string(r.failed), fmt::format("{:.1f}", r.extract_ms), fmt::format("{:.1f}", r.match_ms)}) {
    row.push_back(text);
  }
  return row;
}

}  // namespace

Table frontend_table(const std::vector<FrontendRow>& rows) {
  Table table{
      .title = "Front-ends on pairs of views: means per pair, AUC of the motion by P3P, CPU milliseconds",
      .header = {"pairs of", "front-end", "pairs", "points", "matches", "right", "precision [%]", "on row [%]",
                 "AUC 1/3/5 deg", "AUC 2/5/10 cm", "recall [%]", "wrong", "failed", "extract [ms]", "match [ms]"}};
  for (const FrontendRow& row : rows) table.rows.push_back(cells(row));
  return table;
}

std::string frontend_json(const std::vector<FrontendRow>& rows) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const FrontendRow& r : rows) {
    all.push_back({{"group", r.group},
                   {"frontend", r.frontend},
                   {"pairs", r.pairs},
                   {"points", r.points},
                   {"matches", r.matches},
                   {"right", r.right},
                   {"right_95", r.right_95},
                   {"precision_percent", r.precision},
                   {"on_row_percent", r.on_row},
                   {"failed", r.failed},
                   {"extract_cpu_ms", r.extract_ms},
                   {"match_cpu_ms", r.match_ms}});
    if (!r.has_truth) continue;
    all.back().update({{"auc_percent_at_1_3_5_deg", r.angle_auc},
                       {"auc_percent_at_2_5_10_cm", r.offset_auc},
                       {"recall_percent", r.recall},
                       {"wrong", r.wrong}});
  }
  return all.dump(1) + "\n";
}

}  // namespace demslam

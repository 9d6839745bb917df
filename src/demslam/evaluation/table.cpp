#include "demslam/evaluation/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace demslam {
namespace {

std::string cell(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "-";
}

std::string rmse_cell(const std::optional<ErrorStatistics>& statistics, int decimals) {
  return statistics ? cell(statistics->rmse, decimals) : "-";
}

std::vector<std::string> row_of(const std::string& name, const Evaluation& e) {
  return {name,
          std::to_string(e.poses),
          cell(100.0 * e.completion, 1),
          cell(e.path_length_m, 2),
          cell(e.ate.rmse, 4),
          cell(e.ate_horizontal.rmse, 4),
          cell(e.ate_vertical.rmse, 4),
          cell(e.ate_star, 5),
          cell(e.drift_percent, 3),
          rmse_cell(e.ate_se3, 4),
          rmse_cell(e.rpe, 4),
          rmse_cell(e.rpe_rotation_deg, 4)};
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string latex_field(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (std::string("%_&#$").find(c) != std::string::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

template <class Field>
std::string joined(const std::vector<std::string>& row, const char* separator, const Field& field) {
  std::string line;
  for (std::size_t i = 0; i < row.size(); ++i) line += (i == 0 ? "" : separator) + field(row[i]);
  return line;
}

std::vector<std::size_t> column_widths(const Table& table) {
  std::vector<std::size_t> widths(table.header.size(), 0);
  const auto widen = [&](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  };
  widen(table.header);
  std::for_each(table.rows.begin(), table.rows.end(), widen);
  return widths;
}

}  // namespace

Table evaluation_table(const std::vector<NamedEvaluation>& evaluations) {
  Table table;
  table.header = {"run",          "poses", "done [%]",  "path [m]",      "ATE [m]", "horizontal [m]",
                  "vertical [m]", "ATE*",  "drift [%]", "ATE SE(3) [m]", "RPE [m]", "RPE [deg]"};
  for (const auto& [name, evaluation] : evaluations) table.rows.push_back(row_of(name, evaluation));
  if (!evaluations.empty()) {
    const Evaluation& first = evaluations.front().second;
    table.title = fmt::format("RMSE. ATE: {}. RPE: {}.", title_of(first.alignment), describe(first.rpe_options));
  }
  return table;
}

std::string text_table(const Table& table) {
  const std::vector<std::size_t> widths = column_widths(table);
  const auto line = [&](const std::vector<std::string>& row) {
    std::string text = fmt::format("{:<{}}", row.front(), widths.front());
    for (std::size_t i = 1; i < row.size(); ++i) text += fmt::format("  {:>{}}", row[i], widths[i]);
    return text + "\n";
  };
  std::string text = table.title + "\n" + line(table.header);
  for (const auto& row : table.rows) text += line(row);
  return text;
}

std::string csv_table(const Table& table) {
  std::string text = joined(table.header, ",", csv_field) + "\n";
  for (const auto& row : table.rows) text += joined(row, ",", csv_field) + "\n";
  return text;
}

std::string latex_table(const Table& table) {
  std::string text = "% " + table.title + "\n\\begin{tabular}{l" + std::string(table.header.size() - 1, 'r') + "}\n";
  text += "\\toprule\n" + joined(table.header, " & ", latex_field) + " \\\\\n\\midrule\n";
  for (const auto& row : table.rows) text += joined(row, " & ", latex_field) + " \\\\\n";
  return text + "\\bottomrule\n\\end{tabular}\n";
}

}  // namespace demslam

#include "demslam/experiment/study_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "demslam/base/text.h"
#include "demslam/base/version.h"

namespace demslam {
namespace {

/// A figure of the table: its name with unit, how it is printed, and the published one beside it.
struct Column {
  const char* name;
  StudyFigure figure;
  int decimals;
  double PublishedRow::* published;  ///< null: none was published
};

const std::vector<Column>& columns() {
  static const std::vector<Column> all{{"ATE [m]", &StudyScore::ate_m, 3, &PublishedRow::ate_m},
                                       {"horizontal [m]", &StudyScore::horizontal_m, 3, nullptr},
                                       {"vertical [m]", &StudyScore::vertical_m, 3, nullptr},
                                       {"ATE*", &StudyScore::ate_star, 5, &PublishedRow::ate_star},
                                       {"drift [%]", &StudyScore::drift_percent, 3, &PublishedRow::drift_percent},
                                       {"RPE [m]", &StudyScore::rpe_m, 4, &PublishedRow::rpe_m},
                                       {"NEES/3", &StudyScore::nees, 2, nullptr}};
  return all;
}

/// "0.52 (0.48 to 0.61)": median and quartiles; the median alone of one run.
std::string text_of(const Spread& spread, int decimals) {
  if (spread.runs == 1) return fmt::format("{:.{}f}", spread.median, decimals);
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", spread.median, decimals, spread.lower_quartile, decimals,
                     spread.upper_quartile, decimals);
}

const PublishedRow* find(const std::vector<PublishedRow>& published, const std::string& drive,
                         const std::string& variant) {
  const auto row =
      std::ranges::find_if(published, [&](const PublishedRow& r) { return r.drive == drive && r.variant == variant; });
  return row == published.end() ? nullptr : &*row;
}

std::string cell(const Column& column, const Spread& spread, const PublishedRow* published) {
  std::string text = text_of(spread, column.decimals);
  if (published != nullptr && column.published != nullptr && published->*column.published >= 0.0) {
    text += fmt::format(" *[{:g}]*", published->*column.published);
  }
  return text;
}

/// Calls `row(drive, variant, spreads)` for what has been run, in the study's order.
template <class Row>
void for_each_row(const Study& study, const std::vector<StudyScore>& scores, const Row& row) {
  for (const StudyDrive& drive : study.drives) {
    for (const StudyVariant& variant : study.variants) {
      std::vector<Spread> spreads;
      for (const Column& column : columns()) {
        if (const auto s = spread_of(scores, variant.name, column.figure, drive.name)) spreads.push_back(*s);
      }
      if (!spreads.empty()) row(drive.name, variant.name, spreads);
    }
  }
}

nlohmann::ordered_json json_of(const StudyScore& s) {
  return {{"drive", s.drive},
          {"seed", s.seed},
          {"variant", s.variant},
          {"path_length_m", s.path_m},
          {"completion", s.completion},
          {"ate_rmse_m", s.ate_m},
          {"ate_horizontal_rmse_m", s.horizontal_m},
          {"ate_vertical_rmse_m", s.vertical_m},
          {"ate_star", s.ate_star},
          {"drift_percent", s.drift_percent},
          {"rpe_rmse_m", s.rpe_m},
          {"nees_per_dof", s.nees},
          {"loops", s.loops}};
}

}  // namespace

std::string study_markdown(const Study& study, const std::vector<StudyScore>& scores,
                           const std::vector<PublishedRow>& published) {
  std::string table = fmt::format(
      "{}. RMSE without alignment; median (quartiles) over seeds{}.\n\n| drive | variant | runs | completion [%] |",
      study.title, published.empty() ? "" : "; *[published]*");
  for (const Column& column : columns()) table += fmt::format(" {} |", column.name);
  table += "\n| --- | --- | --- | --- |";
  for (std::size_t i = 0; i < columns().size(); ++i) table += " --- |";
  for_each_row(study, scores, [&](const std::string& drive, const std::string& variant, const auto& spreads) {
    const auto completion = spread_of(scores, variant, &StudyScore::completion, drive);
    table +=
        fmt::format("\n| {} | {} | {} | {:.1f} |", drive, variant, spreads.front().runs, 100.0 * completion->median);
    for (std::size_t i = 0; i < spreads.size(); ++i) {
      table += fmt::format(" {} |", cell(columns()[i], spreads[i], find(published, drive, variant)));
    }
  });
  return table + "\n";
}

std::string study_latex(const Study& study, const std::vector<StudyScore>& scores) {
  std::string rows;
  const auto escaped = [](std::string text) {
    for (std::size_t at = 0; (at = text.find_first_of("_%", at)) != std::string::npos; at += 2) text.insert(at, "\\");
    return text;
  };
  for_each_row(study, scores, [&](const std::string& drive, const std::string& variant, const auto& spreads) {
    rows += fmt::format("{} & {}", escaped(drive), escaped(variant));
    for (std::size_t i = 0; i < spreads.size(); ++i) rows += " & " + text_of(spreads[i], columns()[i].decimals);
    rows += " \\\\\n";
  });
  std::string header = "drive & variant";
  for (const Column& column : columns()) header += " & " + escaped(column.name);
  return fmt::format(
      "% {}: RMSE without alignment, median (quartiles) over seeds\n\\begin{{tabular}}{{ll{}}}\n\\toprule\n{} "
      "\\\\\n\\midrule\n{}\\bottomrule\n\\end{{tabular}}\n",
      study.title, std::string(columns().size(), 'r'), header, rows);
}

std::string scores_csv(const std::vector<StudyScore>& scores) {
  std::string csv;
  for (const StudyScore& score : scores) {
    const auto json = json_of(score);
    std::string names, values;
    for (const auto& [name, value] : json.items()) {
      names += (names.empty() ? "" : ",") + name;
      values += (values.empty() ? "" : ",") + (value.is_string() ? value.template get<std::string>() : value.dump());
    }
    if (csv.empty()) csv = names + "\n";
    csv += values + "\n";
  }
  return csv;
}

std::string scores_json(const Study& study, const std::vector<StudyScore>& scores) {
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const StudyScore& score : scores) runs.push_back(json_of(score));
  return nlohmann::ordered_json{{"demslam", kVersion},
                                {"experiment", study.name},
                                {"title", study.title},
                                {"alignment", "none"},
                                {"runs", runs}}
             .dump(1) +
         "\n";
}

void write_study(const Study& study, const std::vector<StudyScore>& scores, const std::vector<PublishedRow>& published,
                 const std::filesystem::path& out) {
  write_text(out / "table.md", study_markdown(study, scores, published));
  write_text(out / "table.tex", study_latex(study, scores));
  write_text(out / "scores.csv", scores_csv(scores));
  write_text(out / "scores.json", scores_json(study, scores));
}

}  // namespace demslam

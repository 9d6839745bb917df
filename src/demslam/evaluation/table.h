#pragma once

#include <string>
#include <utility>
#include <vector>

#include "demslam/evaluation/evaluate.h"

namespace demslam {

/// A table of results with a title that says what was done to the data. The first column is text, the others numbers.
struct Table {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

using NamedEvaluation = std::pair<std::string, Evaluation>;

/// One row per evaluation. The title is the first one's: evaluations of one table share alignment and RPE options.
Table evaluation_table(const std::vector<NamedEvaluation>& evaluations);

std::string text_table(const Table& table);   ///< aligned columns for a terminal
std::string csv_table(const Table& table);    ///< RFC 4180
std::string latex_table(const Table& table);  ///< booktabs

}  // namespace demslam

#include "demslam/evaluation/markdown.h"

#include <vector>

namespace demslam {
namespace {

std::string line(const std::vector<std::string>& row) {
  std::string text = "|";
  for (const std::string& field : row) text += " " + field + " |";
  return text + "\n";
}

}  // namespace

std::string markdown_table(const Table& table) {
  std::string text = line(table.header) + line(std::vector<std::string>(table.header.size(), "---"));
  for (const auto& row : table.rows) text += line(row);
  return text;
}

}  // namespace demslam

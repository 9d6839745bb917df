#include "demslam/evaluation/markdown.h"

#include <gtest/gtest.h>

namespace demslam {
namespace {

TEST(Markdown, ATableHasItsRule) {
  const Table table{.title = "t", .header = {"run", "ATE [m]"}, .rows = {{"a", "10.25"}, {"c", "-"}}};
  EXPECT_EQ(markdown_table(table), "| run | ATE [m] |\n| --- | --- |\n| a | 10.25 |\n| c | - |\n");
}

}  // namespace
}  // namespace demslam

#include "demslam/evaluation/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const Table kSmall = {"A title.", {"run", "ATE [m]"}, {{"a_1, b", "10.25"}, {"c", "-"}}};

TEST(Table, TextIsAligned) {
  EXPECT_EQ(text_table(kSmall), "A title.\nrun     ATE [m]\na_1, b    10.25\nc             -\n");
}

TEST(Table, CsvQuotesWhatHoldsAComma) { EXPECT_EQ(csv_table(kSmall), "run,ATE [m]\n\"a_1, b\",10.25\nc,-\n"); }

TEST(Table, LatexEscapesAndUsesBooktabs) {
  EXPECT_EQ(
      latex_table(kSmall),
      "% A title.\n\\begin{tabular}{lr}\n\\toprule\nrun & ATE [m] \\\\\n\\midrule\na\\_1, b & 10.25 \\\\\nc & - \\\\\n"
      "\\bottomrule\n\\end{tabular}\n");
}

TEST(Table, TheTitleNamesAlignmentAndDelta) {
  Evaluation evaluation{.alignment = Alignment::se3, .rpe_options = {.delta = 10.0, .unit = DeltaUnit::metres}};
  evaluation.ate.rmse = 1.5;
  const Table table = evaluation_table({{"run", evaluation}});
  EXPECT_EQ(table.title, "RMSE. ATE: SE(3) Umeyama alignment. RPE: over 10 m, consecutive pairs.");
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows[0].size(), table.header.size());
  EXPECT_EQ(table.rows[0][4], "1.5000");
  EXPECT_EQ(table.rows[0].back(), "-");
}

}  // namespace
}  // namespace demslam

#include "demslam/base/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Text, SecondsBecomeNanosecondsWithoutLosingADigit) {
  EXPECT_EQ(seconds_to_ns("1403715529.112143517"), 1403715529112143517);
  EXPECT_EQ(seconds_to_ns("1.403715529112143517e+09"), 1403715529112143517);
  EXPECT_EQ(seconds_to_ns("1.036224e-01"), 103622400);
  EXPECT_EQ(seconds_to_ns("0.000000e+00"), 0);
  EXPECT_EQ(seconds_to_ns("12"), 12000000000);
  EXPECT_EQ(seconds_to_ns("-0.5"), -500000000);
  EXPECT_EQ(seconds_to_ns("0.0000000015"), 2);
  EXPECT_EQ(seconds_to_ns("1e-20"), 0);
}

TEST(Text, ScalesDecimalsByAnyPower) {
  EXPECT_EQ(scaled_integer("1.625657732290284032e+18", 0), 1625657732290284032);
  EXPECT_EQ(scaled_integer("1625657732290284032.000000", 0), 1625657732290284032);
  EXPECT_EQ(scaled_integer("-2.5", 0), -3);
}

TEST(Text, RefusesSecondsThatAreNoNumberOrDoNotFit) {
  for (const char* text : {"", ".", "nan", "1.2.3", "1e", "1e400", "12x", "99999999999999", "- 1"}) {
    EXPECT_EQ(seconds_to_ns(text), std::nullopt) << text;
  }
}

TEST(Text, SecondsTextReadsBackExactly) {
  EXPECT_EQ(seconds_text(1403715529112143517), "1403715529.112143517");
  EXPECT_EQ(seconds_text(5), "0.000000005");
  EXPECT_EQ(seconds_text(-1500000000), "-1.500000000");
  EXPECT_EQ(seconds_to_ns(seconds_text(1625657732290284032)), 1625657732290284032);
}

TEST(Text, TablesKeepTheirLineNumbersAndSkipComments) {
  const TextTable table = parse_table("# head\n\n 1, a b ,3\r\n% note\n4,,6", "t.csv");
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].line, 3);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1", "a b", "3"));
  EXPECT_EQ(table.rows[1].line, 5);
  EXPECT_THAT(table.rows[1].fields, ElementsAre("4", "", "6"));
}

TEST(Text, TablesWithoutCommasSplitAtBlanks) {
  const TextTable table = parse_table("1.5\t -2  3e2\n", "t.txt");
  EXPECT_FALSE(table.commas);
  EXPECT_DOUBLE_EQ(table.number(table.rows[0], 2), 300.0);
}

TEST(Text, ABadFieldIsAnErrorWithFileAndLine) {
  const TextTable table = parse_table("1\nnan\nx", "t.txt");
  EXPECT_THAT([&] { table.number(table.rows[1], 0); }, ThrowsMessage<Error>(HasSubstr("t.txt:2: 'nan'")));
  EXPECT_THAT([&] { table.integer(table.rows[2], 0); }, ThrowsMessage<Error>(HasSubstr("t.txt:3: 'x'")));
  EXPECT_THAT([&] { table.number(table.rows[0], 1); }, ThrowsMessage<Error>(HasSubstr("column 2 is missing")));
}

TEST(Text, AMissingFileIsAnErrorThatNamesIt) {
  EXPECT_THAT([] { read_text("/nowhere/at.all"); }, ThrowsMessage<Error>(HasSubstr("/nowhere/at.all")));
}

TEST(Text, AFileThatCannotBeWrittenIsNamed) {
  EXPECT_THAT([] { write_text("/nowhere/at.all", "x"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere/at.all: cannot be written")));
  EXPECT_THAT([] { write_text("/dev/full", "x"); }, ThrowsMessage<Error>(HasSubstr("/dev/full: cannot be written")));
}

}  // namespace
}  // namespace demslam

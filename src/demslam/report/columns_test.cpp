#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "demslam/report/columns.h"
#include "demslam/report/internal/packed.h"

namespace demslam {
namespace {

using testing::Each;
using testing::IsNan;

Columns ramp_with_a_peak(std::size_t rows, std::size_t peak) {
  Columns columns{{"distance_m", {}}, {"time_ms", {}}};
  for (std::size_t row = 0; row < rows; ++row) {
    columns[0].values.push_back(static_cast<float>(row));
    columns[1].values.push_back(row == peak ? 900.0F : 40.0F);
  }
  return columns;
}

TEST(Envelope, KeepsASinglePeakOfManyRows) {
  const Columns small = envelope(ramp_with_a_peak(10000, 5003), 200);
  EXPECT_LE(small[0].values.size(), 200U);
  EXPECT_EQ(small[1].values.size(), small[0].values.size());
  EXPECT_EQ(*std::max_element(small[1].values.begin(), small[1].values.end()), 900.0F);
  EXPECT_TRUE(std::is_sorted(small[0].values.begin(), small[0].values.end()));
  EXPECT_EQ(small[0].values.front(), 0.0F);
  EXPECT_EQ(small[0].values.back(), 9999.0F);
}

TEST(Envelope, LeavesWhatFitsAsItIs) {
  const Columns columns = ramp_with_a_peak(100, 50);
  EXPECT_EQ(envelope(columns, 100)[1].values, columns[1].values);
}

TEST(Envelope, StretchesWithoutValuesStayEmpty) {
  Columns columns = ramp_with_a_peak(1000, 0);
  std::fill(columns[1].values.begin(), columns[1].values.end(), NAN);
  EXPECT_THAT(envelope(columns, 10)[1].values, Each(IsNan()));
}

TEST(Thinned, KeepsTheFirstAndTheLastRow) {
  const Columns small = thinned(ramp_with_a_peak(10000, 0), 100);
  EXPECT_LE(small[0].values.size(), 100U);
  EXPECT_EQ(small[0].values.front(), 0.0F);
  EXPECT_EQ(small[0].values.back(), 9999.0F);
}

TEST(ColumnStatistics, PassOverMissingValues) {
  const ColumnStatistics s = statistics_of({"x", {3.0F, NAN, 1.0F, 2.0F}});
  EXPECT_EQ(s.count, 3U);
  EXPECT_DOUBLE_EQ(s.mean, 2.0);
  EXPECT_DOUBLE_EQ(s.median, 2.0);
  EXPECT_DOUBLE_EQ(s.max, 3.0);
}

TEST(Packed, FollowsTheBase64Standard) {
  EXPECT_EQ(base64("fo"), "Zm8=");  // the vectors of RFC 4648
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(""), "");
}

TEST(Packed, HoldsLittleEndianNumbersUnderTheirNames) {
  const Columns columns{{"x_m", {1.0F}}};
  EXPECT_EQ(packed(columns).dump(), R"({"x_m":{"f32":"AACAPw=="}})");
}

}  // namespace
}  // namespace demslam

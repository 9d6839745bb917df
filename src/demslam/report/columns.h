#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace demslam {

/// A quantity over the rows of a table; its name ends in its unit ("rms_px"). NaN: no value.
struct Column {
  std::string name;
  std::vector<float> values;
};

/// Columns of equal length. The first one is what the others are drawn over.
using Columns = std::vector<Column>;

/// At most about `max_rows` rows that still show every peak: consecutive rows become two, which hold each column's
/// least and greatest value in the order in which they occurred. The first column keeps its own order. Rows that
/// already fit stay as they are.
Columns envelope(const Columns& columns, std::size_t max_rows);

/// Every n-th row and the last one, at most `max_rows`.
Columns thinned(const Columns& columns, std::size_t max_rows);

/// Of a column's finite values; all zero when there is none.
struct ColumnStatistics {
  std::size_t count = 0;
  double mean = 0.0, median = 0.0, p95 = 0.0, max = 0.0;
};
ColumnStatistics statistics_of(const Column& column);

}  // namespace demslam

#include "demslam/report/columns.h"

#include <algorithm>
#include <cmath>

namespace demslam {
namespace {

using Iterator = std::vector<float>::const_iterator;

/// The least and the greatest value of a range, whichever comes first, first. NaN counts for nothing.
std::pair<float, float> extremes(Iterator begin, Iterator end) {
  Iterator low = end, high = end;
  for (Iterator it = begin; it != end; ++it) {
    if (std::isnan(*it)) continue;
    if (low == end || *it < *low) low = it;
    if (high == end || *it > *high) high = it;
  }
  if (low == end) return {NAN, NAN};
  return low < high ? std::pair{*low, *high} : std::pair{*high, *low};
}

std::vector<float> envelope_of(const std::vector<float>& values, std::size_t rows_per_pair) {
  std::vector<float> result;
  for (std::size_t begin = 0; begin < values.size(); begin += rows_per_pair) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = values.begin() + static_cast<std::ptrdiff_t>(std::min(begin + rows_per_pair, values.size()));
    const auto [one, other] = extremes(first, last);
    result.push_back(one);
    result.push_back(other);
  }
  return result;
}

std::size_t divided_up(std::size_t n, std::size_t by) { return (n + by - 1) / by; }

}  // namespace

Columns envelope(const Columns& columns, std::size_t max_rows) {
  if (columns.empty() || columns.front().values.size() <= max_rows) return columns;
  const std::size_t pairs = std::max<std::size_t>(max_rows / 2, 1);
  const std::size_t rows_per_pair = divided_up(columns.front().values.size(), pairs);
  Columns result;
  for (const Column& column : columns) result.push_back({column.name, envelope_of(column.values, rows_per_pair)});
  return result;
}

Columns thinned(const Columns& columns, std::size_t max_rows) {
  if (columns.empty() || columns.front().values.size() <= max_rows) return columns;
  const std::size_t rows = columns.front().values.size(),
                    step = divided_up(rows - 1, std::max<std::size_t>(max_rows - 1, 1));
  Columns result;
  for (const Column& column : columns) {
    Column& thin = result.emplace_back(Column{column.name, {}});
    for (std::size_t row = 0; row + 1 < rows; row += step) thin.values.push_back(column.values[row]);
    thin.values.push_back(column.values.back());
  }
  return result;
}

ColumnStatistics statistics_of(const Column& column) {
  std::vector<float> values;
  std::copy_if(column.values.begin(), column.values.end(), std::back_inserter(values),
               [](float value) { return std::isfinite(value); });
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  double sum = 0.0;
  for (const float value : values) sum += value;
  const auto quantile = [&](double q) { return values[static_cast<std::size_t>(q * double(values.size() - 1) + 0.5)]; };
  return {values.size(), sum / static_cast<double>(values.size()), quantile(0.5), quantile(0.95), values.back()};
}

}  // namespace demslam

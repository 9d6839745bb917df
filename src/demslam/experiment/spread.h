#pragma once

#include <cstddef>
#include <vector>

namespace demslam {

/// Median, quartiles and worst of one figure over several runs.
struct Spread {
  std::size_t runs = 0;
  double median = 0.0, lower_quartile = 0.0, upper_quartile = 0.0, worst = 0.0;
};
/// Quartiles as numpy's default (linear between order statistics). `values` may not be empty.
Spread spread_of(std::vector<double> values);

}  // namespace demslam

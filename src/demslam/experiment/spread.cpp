#include "demslam/experiment/spread.h"

#include <algorithm>

namespace demslam {

Spread spread_of(std::vector<double> values) {
  std::ranges::sort(values);
  const auto quantile = [&](double q) {
    const double at = q * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {values.size(), quantile(0.5), quantile(0.25), quantile(0.75), values.back()};
}

}  // namespace demslam

#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace gtsam {
class NonlinearFactor;
}

namespace demslam {

/// How well a factor agrees with the present estimate.
struct FactorResidual {
  std::string kind;
  std::size_t keyframe = 0;  ///< the oldest it speaks of
  std::size_t rows = 0;
  double chi_square = 0.0;  ///< `rows` degrees of freedom, by the factor's own noise, before any robust kernel
};

/// A factor's kind; empty: it is not asked for.
using FactorKindOf = std::function<std::string(const gtsam::NonlinearFactor&)>;

}  // namespace demslam

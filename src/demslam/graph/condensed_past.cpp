#include "demslam/graph/condensed_past.h"

#include <gtsam/linear/GaussianBayesNet.h>
#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/nonlinear/LinearContainerFactor.h>

#include <algorithm>

namespace demslam {
namespace {

constexpr std::size_t kStep = 200;  // keyframes eliminated at once, so that elimination trees stay shallow

/// Keys that somebody after `end` still speaks of.
gtsam::KeySet needed_after(std::size_t end, const CondensedPast::FactorsByKeyframe& factors_from) {
  gtsam::KeySet needed;
  for (std::size_t k = end; k < factors_from.size(); ++k) {
    needed.insert(k);
    for (const auto& factor : factors_from[k]) needed.insert(factor->begin(), factor->end());
  }
  return needed;
}

/// Keys of `graph` that are not needed: keyframes in order, then the other variables (they touch many keyframes).
gtsam::Ordering eliminated(const gtsam::NonlinearFactorGraph& graph, const gtsam::KeySet& needed) {
  gtsam::Ordering ordering;
  for (const gtsam::Key key : graph.keys()) {  // symbols sort behind keyframes
    if (!needed.exists(key)) ordering.push_back(key);
  }
  return ordering;
}

}  // namespace

gtsam::Values values_of(const gtsam::KeySet& keys, const gtsam::Values& values) {
  gtsam::Values part;
  for (const gtsam::Key key : keys) part.insert(key, values.at(key));
  return part;
}

void CondensedPast::extend_to(std::size_t end, const FactorsByKeyframe& factors_from, const gtsam::Values& values) {
  while (end_ < end) {
    const std::size_t next = std::min(end, end_ + kStep);
    gtsam::NonlinearFactorGraph graph = factors_;
    for (; end_ < next; ++end_) graph.push_back(factors_from[end_]);
    const gtsam::Values here = values_of(graph.keys(), values);
    const gtsam::Ordering ordering = eliminated(graph, needed_after(end_, factors_from));
    const auto remaining = graph.linearize(here)->eliminatePartialSequential(ordering).second;
    factors_ = gtsam::NonlinearFactorGraph();
    for (const auto& factor : *remaining) {
      if (factor && !factor->empty()) factors_.emplace_shared<gtsam::LinearContainerFactor>(factor, here);
    }
  }
}

}  // namespace demslam

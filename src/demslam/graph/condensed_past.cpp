#include "demslam/graph/condensed_past.h"

#include <gtsam/linear/GaussianBayesTree.h>
#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/nonlinear/LinearContainerFactor.h>

#include <algorithm>

#include "demslam/graph/elimination_order.h"

namespace demslam {
namespace {

/// What nobody needs any more, in nested-dissection order: the whole past at once is no dearer than a batch, loops or
/// not.
gtsam::Ordering eliminated(const gtsam::NonlinearFactorGraph& graph, std::size_t end, const FactorTable& table) {
  gtsam::Ordering ordering;
  for (const gtsam::Key key : nested_dissection(graph)) {
    if (!table.needed_from(key, end)) ordering.push_back(key);
  }
  return ordering;
}

}  // namespace

gtsam::Values values_of(const gtsam::KeySet& keys, const gtsam::Values& values) {
  gtsam::Values part;
  for (const gtsam::Key key : keys) part.insert(key, values.at(key));
  return part;
}

void CondensedPast::extend_to(std::size_t end, const FactorTable& table, const gtsam::Values& values) {
  if (end <= end_) return;
  gtsam::NonlinearFactorGraph graph = factors_;
  table.append_to(graph, end_, end);
  end_ = end;
  if (graph.empty()) return;
  const gtsam::Values here = values_of(graph.keys(), values);
  const auto remaining = graph.linearize(here)->eliminatePartialMultifrontal(eliminated(graph, end, table)).second;
  factors_ = gtsam::NonlinearFactorGraph();
  for (const auto& factor : *remaining) {
    if (factor && !factor->empty()) factors_.emplace_shared<gtsam::LinearContainerFactor>(factor, here);
  }
}

}  // namespace demslam

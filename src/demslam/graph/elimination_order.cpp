#include "demslam/graph/elimination_order.h"

#include <mutex>

namespace demslam {
namespace {

std::mutex metis;

template <typename Graph>
gtsam::Ordering alone(const Graph& graph) {
  const std::scoped_lock lock(metis);
  return gtsam::Ordering::Metis(graph);
}

}  // namespace

gtsam::Ordering nested_dissection(const gtsam::NonlinearFactorGraph& graph) { return alone(graph); }
gtsam::Ordering nested_dissection(const gtsam::GaussianFactorGraph& graph) { return alone(graph); }

}  // namespace demslam

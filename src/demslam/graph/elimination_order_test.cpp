#include "demslam/graph/elimination_order.h"

#include <gtest/gtest.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/slam/BetweenFactor.h>

#include <atomic>
#include <thread>

namespace demslam {
namespace {

/// A ring of `size` keyframes with a chord from each to its `chord`-th neighbour.
gtsam::NonlinearFactorGraph ring(std::size_t size, std::size_t chord) {
  const auto noise = gtsam::noiseModel::Unit::Create(6);
  gtsam::NonlinearFactorGraph graph;
  for (std::size_t i = 0; i < size; ++i) {
    for (const std::size_t step : {std::size_t{1}, chord})
      graph.emplace_shared<gtsam::BetweenFactor<gtsam::Pose3>>(i, (i + step) % size, gtsam::Pose3(), noise);
  }
  return graph;
}

TEST(NestedDissection, GivesTheSameOrderWhileOtherThreadsOrderToo) {
  const gtsam::NonlinearFactorGraph graph = ring(600, 37), other = ring(500, 23);
  const gtsam::Ordering alone = nested_dissection(graph);
  EXPECT_EQ(alone.size(), 600U);
  std::atomic<bool> done = false;
  std::thread beside([&] {
    while (!done) nested_dissection(other);
  });
  int others = 0;
  for (int i = 0; i < 200; ++i) others += nested_dissection(graph) == alone ? 0 : 1;
  done = true;
  beside.join();
  EXPECT_EQ(others, 0);
}

}  // namespace
}  // namespace demslam

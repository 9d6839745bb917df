#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <numeric>

#include "demslam/graph/pose_graph.h"
#include "demslam/graph/test_paths.h"

namespace demslam {
namespace {

using namespace test;

constexpr std::size_t kKeyframes = 801, kFixEvery = 20;
constexpr double kWithin = 1e-3;  // metres and radians, of sigmas of some 0.1 m
const Matrix6d kFix = isotropic(0.02, 0.3);

/// Odometry of a circle with an absolute fix every kFixEvery keyframes, solved in a window as it grows, or not at all.
PoseGraph anchored(const std::vector<Pose>& truth, bool solve_on_the_way, bool systematic) {
  Random random(31);
  PoseGraph graph({.systematic = {.enabled = systematic}, .window_m = 60.0});
  graph.add_keyframe(truth[0]);
  graph.add_prior(0, truth[0], kTight);
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const RelativePose step = between(truth, k - 1, k, kOdometry, random);
    graph.add_keyframe(graph.T_map_body(k - 1) * graph.corrected_odometry(step));
    graph.add_odometry(step);
    if (k % kFixEvery != 0) continue;
    graph.add_prior(k - 5, truth[k - 5] * Pose::exp(noise(random, kFix)), kFix);
    if (solve_on_the_way) graph.optimize_recent();
  }
  return graph;
}

void expect_the_same(const PoseGraph& a, const PoseGraph& b, double within_m, double covariances_within) {
  std::vector<std::size_t> all(a.size());
  std::iota(all.begin(), all.end(), 0U);
  const auto of_a = a.covariances(all), of_b = b.covariances(all);
  for (const std::size_t k : all) {
    ASSERT_LT((a.T_map_body(k).inverse() * b.T_map_body(k)).log().norm(), within_m) << k;
    ASSERT_TRUE(of_a[k].isApprox(of_b[k], covariances_within)) << k;
  }
}

class Folding : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(SystematicStates, Folding, testing::Bool());

TEST_P(Folding, TheBatchOverWhatIsLeftIsTheBatchOverEverything) {
  const auto truth = circle(kKeyframes, 1.0);
  PoseGraph folded = anchored(truth, true, GetParam()), full = anchored(truth, false, GetParam());
  folded.optimize();
  full.optimize();
  EXPECT_LT(folded.variables(), full.variables() / 4);
  expect_the_same(folded, full, kWithin, 0.02);
}

TEST_P(Folding, ALoopBetweenFoldedKeyframesStillCorrectsThem) {
  const auto truth = circle(kKeyframes, 1.0);
  PoseGraph folded = anchored(truth, true, GetParam()), full = anchored(truth, false, GetParam());
  Random random(7);
  const RelativePose loop = between(truth, 42, 613, 0.1 * kLoop, random);
  for (PoseGraph* graph : {&folded, &full}) {
    graph->optimize();
    graph->add_loop(loop);
    graph->optimize();
  }
  expect_the_same(folded, full, kWithin, 0.02);
}

TEST(Folding, TheRunsOwnEstimateStaysWithinAThirdOfItsSigmaOfTheBatch) {
  const auto truth = circle(kKeyframes, 1.0);
  PoseGraph graph = anchored(truth, true, true);
  const Pose newest = graph.T_map_body(kKeyframes - 1);
  const Matrix6d covariance = graph.newest_covariance();
  graph.optimize();
  const Vector6d difference = (newest.inverse() * graph.T_map_body(kKeyframes - 1)).log();
  EXPECT_LT(difference.dot(covariance.ldlt().solve(difference)), 0.1);
}

TEST(Folding, WithoutAbsoluteFixesHardlyAnythingIsLeft) {
  const auto truth = circle(2001, 0.5);
  PoseGraph graph = odometry_graph(truth, 3);
  for (const std::size_t first : {700, 1400, 1900}) graph.optimize_window(first);
  EXPECT_LT(graph.variables(), 150U);
  Random random(4);
  graph.add_loop(between(truth, 0, 2000, kLoop, random));
  graph.optimize();
  double worst_m = 0.0;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const Pose step = graph.T_map_body(k - 1).inverse() * graph.T_map_body(k);
    worst_m = std::max(worst_m, (step.inverse() * truth[k - 1].inverse() * truth[k]).log().norm());
  }
  EXPECT_LT(worst_m, 0.15);  // no kinks where folded stretches meet
  EXPECT_LT((graph.T_map_body(2000).translation() - truth[2000].translation()).norm(), 0.05);
}

TEST(OptimizeRecent, ABatchComesOnlyWhenALoopTellsSomethingNew) {
  const auto truth = circle(401, 1.0);
  PoseGraph graph = odometry_graph(truth, 2);
  RelativePose known{10, 390, graph.T_map_body(10).inverse() * graph.T_map_body(390), kLoop};
  graph.add_loop(known);
  EXPECT_FALSE(graph.optimize_recent().batch);
  Random random(5);
  graph.add_loop(between(truth, 0, 400, kLoop, random));
  EXPECT_FALSE(graph.optimize_recent().batch);  // it has begun
  EXPECT_FALSE(graph.batch_is_ready());
  for (int k = 0; k < 3; ++k) {  // 0.5 % of 400 m
    graph.add_keyframe(graph.T_map_body(graph.size() - 1) * (truth[0].inverse() * truth[1]));
    graph.add_odometry({graph.size() - 2, graph.size() - 1, truth[0].inverse() * truth[1], kOdometry});
  }
  EXPECT_TRUE(graph.batch_is_ready());
  EXPECT_TRUE(graph.optimize_recent().batch);
  EXPECT_EQ(graph.batches(), 1U);
  EXPECT_FALSE(graph.batch_is_ready());
  EXPECT_FALSE(graph.optimize_recent().batch);
}

TEST(RelativeCovariance, IsNeverLessThanWhatTheWholeGraphSays) {
  const auto truth = circle(kKeyframes, 1.0);
  const PoseGraph graph = anchored(truth, true, true);
  const auto marginals = graph.covariances({100, 700});
  const Matrix6d A = (graph.T_map_body(700).inverse() * graph.T_map_body(100)).adjoint();
  const Matrix6d exact_if_independent = marginals[1] + A * marginals[0] * A.transpose();
  const Matrix6d bound = graph.relative_covariance(100, 700);
  const Matrix6d margin = bound - exact_if_independent;
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(margin).eigenvalues().minCoeff(), -1e-6);
  EXPECT_LT(bound.trace(), 4.0 * exact_if_independent.trace());
}

}  // namespace
}  // namespace demslam

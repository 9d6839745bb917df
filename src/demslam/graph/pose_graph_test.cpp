#include "demslam/graph/pose_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <gtsam/linear/GaussianBayesNet.h>
#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/factorTesting.h>

#include <cmath>
#include <cstring>

#include "demslam/base/error.h"
#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/odometry_chain.h"
#include "demslam/graph/odometry_factor.h"
#include "demslam/graph/test_paths.h"

namespace demslam {
namespace {

using namespace test;

double end_error_m(const PoseGraph& graph, const std::vector<Pose>& truth) {
  return (graph.T_map_body(graph.size() - 1).translation() - truth.back().translation()).norm();
}

TEST(GtsamPose, GoesThereAndBackAndSharesTheTangent) {
  Vector6d xi;
  xi << 0.1, -0.2, 0.3, 1.0, 2.0, -3.0;
  const Pose T = Pose::exp(xi);
  EXPECT_LT((from_gtsam(to_gtsam(T)).inverse() * T).log().norm(), 1e-12);
  EXPECT_LT((gtsam::Pose3::Logmap(to_gtsam(T)) - xi).norm(), 1e-9);
}

TEST(PoseGraph, KeepsDeadReckoningWithoutLoops) {
  const auto truth = circle(50, 1.0);
  PoseGraph graph = odometry_graph(truth, 1);
  const Pose before = graph.T_map_body(49);
  EXPECT_LT(graph.optimize().error_after, 1e-9);
  EXPECT_LT((before.inverse() * graph.T_map_body(49)).log().norm(), 1e-6);
}

TEST(PoseGraph, ALoopPullsTheEndBack) {
  const auto truth = circle(200, 1.0);
  PoseGraph graph = odometry_graph(truth, 2);
  const double before_m = end_error_m(graph, truth);
  Random random(3);
  graph.add_loop(between(truth, 0, 199, kLoop, random));
  const OptimizerReport report = graph.optimize();
  EXPECT_LT(report.error_after, report.error_before);
  EXPECT_LT(end_error_m(graph, truth), 0.05);
  EXPECT_GT(before_m, 0.3);
  EXPECT_EQ(graph.loops(), 1U);
}

TEST(PoseGraph, OneFalseLoopAmongTrueOnesIsIgnored) {
  const auto truth = circle(100, 1.0);
  PoseGraph graph = odometry_graph(truth, 4);
  Random random(5);
  for (const std::size_t k : {97, 98, 99}) graph.add_loop(between(truth, k - 97, k, kLoop, random));
  graph.add_loop({20, 70, Pose(), kLoop});
  graph.optimize();
  EXPECT_LT(end_error_m(graph, truth), 0.05);
  EXPECT_LT((graph.T_map_body(50).translation() - truth[50].translation()).norm(), 0.6);
}

TEST(PoseGraph, CovarianceGrowsAlongThePathAndPredictsTheError) {
  const auto truth = circle(60, 1.0);
  double nees = 0.0;
  const int runs = 60;
  for (int run = 0; run < runs; ++run) {
    const PoseGraph graph = odometry_graph(truth, 100 + run);
    const Vector6d error = (graph.T_map_body(30).inverse() * truth[30]).log();
    nees += error.dot(graph.covariances({30}).front().ldlt().solve(error)) / (6.0 * runs);
  }
  EXPECT_NEAR(nees, 1.0, 0.25);
  const PoseGraph graph = odometry_graph(truth, 1);
  const auto c = graph.covariances({5, 50});
  EXPECT_GT(c[1].trace(), 10.0 * c[0].trace());
}

TEST(PoseGraph, ChiSquareOfTrueLoopsIsThatOfSixDegreesOfFreedomAndFalseOnesStandOut) {
  const auto truth = circle(80, 1.0);
  double sum = 0.0;
  for (int run = 0; run < 60; ++run) {
    const PoseGraph graph = odometry_graph(truth, 200 + run);
    Random random(900 + run);
    sum += graph.chi_square(between(truth, 10, 75, kLoop, random)) / 60.0;
  }
  EXPECT_NEAR(sum, 6.0, 1.5);
  EXPECT_GT(odometry_graph(truth, 1).chi_square({10, 75, Pose(), kLoop}), 100.0);
}

TEST(PoseGraph, RelativeCovarianceOfNeighboursIsTheOdometrys) {
  const PoseGraph graph = odometry_graph(circle(30, 1.0), 6);
  EXPECT_TRUE(graph.relative_covariance(12, 13).isApprox(kOdometry, 1e-3));
}

TEST(PoseGraph, SameCallsGiveTheSameBytes) {
  const auto truth = circle(1500, 1.0);
  const auto run = [&] {
    PoseGraph graph = odometry_graph(truth, 7, {.systematic = {.enabled = true}});
    Random random(8);
    for (std::size_t k = 0; k < 40; ++k) graph.add_loop(between(truth, k, 1499 - k, kLoop, random));
    graph.optimize();
    return graph;
  };
  const PoseGraph a = run(), b = run();
  for (std::size_t k = 0; k < truth.size(); ++k) {
    ASSERT_EQ(std::memcmp(a.T_map_body(k).translation().data(), b.T_map_body(k).translation().data(), 24), 0) << k;
    ASSERT_EQ(std::memcmp(a.T_map_body(k).rotation().coeffs().data(), b.T_map_body(k).rotation().coeffs().data(), 32),
              0);
  }
  EXPECT_EQ(a.covariances({700}).front(), b.covariances({700}).front());
}

/// Odometry with an absolute fix every 20 keyframes, optimised in a window of 40 as it grows.
PoseGraph windowed(const std::vector<Pose>& truth, std::vector<std::size_t>* problem_sizes = nullptr) {
  Random random(21);
  PoseGraph graph({.systematic = {.enabled = true, .stretch_m = 50.0}});
  graph.add_keyframe(truth[0]);
  graph.add_prior(0, truth[0], kTight);
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const RelativePose step = between(truth, k - 1, k, kOdometry, random);
    graph.add_keyframe(graph.T_map_body(k - 1) * step.T_i_j);
    graph.add_odometry(step);
    if (k % 20 != 0) continue;
    graph.add_prior(k - 5, truth[k - 5] * Pose::exp(noise(random, 100.0 * kLoop)), 100.0 * kLoop);
    const OptimizerReport report = graph.optimize_window(k > 40 ? k - 40 : 0);
    if (problem_sizes != nullptr) problem_sizes->push_back(report.factors);
  }
  return graph;
}

TEST(OptimizeWindow, AgreesWithTheBatchAtTheNewestKeyframe) {
  const auto truth = circle(601, 1.0);
  PoseGraph graph = windowed(truth);
  const Pose newest = graph.T_map_body(600);
  const Matrix6d covariance = graph.newest_covariance();
  graph.optimize();
  const Vector6d difference = (newest.inverse() * graph.T_map_body(600)).log();
  EXPECT_LT(difference.dot(covariance.ldlt().solve(difference)), 0.1);
  EXPECT_TRUE(covariance.isApprox(graph.covariances({600}).front(), 0.05));
}

TEST(OptimizeWindow, SolvesProblemsOfTheSameSizeHoweverLongThePath) {
  std::vector<std::size_t> sizes;
  windowed(circle(2001, 1.0), &sizes);
  EXPECT_LE(sizes.back(), sizes[10] + 2);
}

TEST(OptimizeWindow, ABatchInBetweenPutsLoopsIntoPlay) {
  const auto truth = circle(400, 1.0);
  PoseGraph graph = odometry_graph(truth, 2);
  graph.optimize_window(350);
  const double before_m = end_error_m(graph, truth);
  Random random(3);
  graph.add_loop(between(truth, 0, 399, kLoop, random));
  graph.optimize_window(360);
  EXPECT_NEAR(end_error_m(graph, truth), before_m, 1e-6);
  graph.optimize();
  EXPECT_LT(end_error_m(graph, truth), 0.05);
  graph.optimize_window(370);
  EXPECT_LT(end_error_m(graph, truth), 0.05);
}

TEST(PoseGraph, ALoopThatLaterOnesContradictIsSwitchedOffAndTheEstimateIsAsWithoutIt) {
  const auto truth = circle(200, 1.0);
  PoseGraph graph = odometry_graph(truth, 9), clean = odometry_graph(truth, 9);
  RelativePose wrong{20, 180, truth[20].inverse() * truth[180], kLoop};
  wrong.T_i_j = wrong.T_i_j * Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 1.5, 0.0));
  graph.add_loop(wrong);
  EXPECT_EQ(graph.optimize().loops_switched, 0);
  for (const std::size_t k : {170, 178, 182, 190}) {
    Random random(k);
    const RelativePose right = between(truth, k - 160, k, kLoop, random);
    graph.add_loop(right);
    clean.add_loop(right);
  }
  EXPECT_EQ(graph.optimize().loops_switched, 1);
  EXPECT_FALSE(graph.loop_is_on(0));
  EXPECT_TRUE(graph.loop_is_on(1));
  clean.optimize();
  for (std::size_t k = 0; k < truth.size(); k += 10)
    EXPECT_LT((graph.T_map_body(k).translation() - clean.T_map_body(k).translation()).norm(), 1e-3) << k;
}

/// Nine views around (i, j) whose place is taken for one 0.8 m beside it.
std::vector<RelativePose> displaced_loop(const std::vector<Pose>& truth, std::size_t i, std::size_t j) {
  Random random(31);
  const Pose aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.8, 0.0, 0.0));
  std::vector<RelativePose> loop;
  for (std::size_t k = 0; k < 9; ++k) {
    const Pose T_i_j = truth[i + k].inverse() * aside * truth[j + k];
    loop.push_back({i + k, j + k, T_i_j * Pose::exp(noise(random, kLoop)), kLoop});
  }
  return loop;
}

TEST(PoseGraph, AFalseLoopThatHidesInALooseGraphIsLeftOutOnceTheRestIsTight) {
  const auto truth = circle(200, 1.0);
  PoseGraph graph = odometry_graph(truth, 9), clean = odometry_graph(truth, 9);
  graph.add_loop(displaced_loop(truth, 40, 140));
  EXPECT_EQ(graph.optimize().loops_switched, 0);  // the odometry of 100 m cannot tell
  Random random(32);
  const Matrix6d fix = isotropic(0.05, 0.15);
  for (std::size_t k = 10; k < truth.size(); k += 10) {
    const Pose measured = truth[k] * Pose::exp(noise(random, fix));
    graph.add_prior(k, measured, fix);
    clean.add_prior(k, measured, fix);
  }
  for (const std::size_t k : {190, 193, 196}) {
    const RelativePose right = between(truth, k - 190, k, kLoop, random);
    graph.add_loop(right);
    clean.add_loop(right);
  }
  EXPECT_EQ(graph.optimize().loops_switched, 1);
  EXPECT_FALSE(graph.loop_is_on(0));
  for (const std::size_t loop : {1, 2, 3}) EXPECT_TRUE(graph.loop_is_on(loop));
  clean.optimize();
  for (std::size_t k = 0; k < truth.size(); k += 10)
    EXPECT_LT((graph.T_map_body(k).translation() - clean.T_map_body(k).translation()).norm(), 1e-3) << k;
}

TEST(PoseGraph, TrueLoopsStayHoweverManyThereAre) {
  auto truth = circle(200, 1.0);
  const auto lap = truth;
  truth.insert(truth.end(), lap.begin() + 1, lap.end());
  PoseGraph graph = odometry_graph(truth, 12);
  Random random(13);
  for (std::size_t k = 5; k < 195; k += 5) {
    graph.add_loop({between(truth, k, k + 199, kLoop, random), between(truth, k + 1, k + 200, kLoop, random)});
  }
  EXPECT_EQ(graph.optimize().loops_switched, 0);
}

TEST(PoseGraph, SaysWhatIsNotTied) {
  PoseGraph graph;
  graph.add_keyframe(Pose());
  graph.add_keyframe(Pose());
  graph.add_odometry({0, 1, Pose(), kOdometry});
  EXPECT_THAT([&] { graph.optimize(); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("keyframe 0 is held by no prior")));
  EXPECT_THROW(graph.covariances({1}), Error);
}

TEST(SystematicOdometryFactor, IsZeroAtTruth) {
  Vector6d step;
  step << 0.02, -0.1, 0.3, 1.5, 0.2, -0.1;
  const Vector4d s(0.02, 0.001, -0.002, 0.003);
  const Pose measured = Pose::exp(step);
  const SystematicOdometryFactor factor(0, 1, 2, measured, gtsam::noiseModel::Unit::Create(6));
  const Pose T_map_i = Pose::exp(2.0 * step);
  EXPECT_LT(factor.evaluateError(to_gtsam(T_map_i), to_gtsam(T_map_i * corrected(measured, s)), s).norm(), 1e-12);
}

TEST(SystematicOdometryFactor, HasItsNumericJacobian) {
  Vector6d step;
  step << 0.02, -0.1, 0.3, 1.5, 0.2, -0.1;
  const SystematicOdometryFactor factor(0, 1, 2, Pose::exp(step), gtsam::noiseModel::Unit::Create(6));
  gtsam::Values values;
  values.insert(0, to_gtsam(Pose::exp(2.0 * step)));
  values.insert(1, to_gtsam(Pose::exp(3.3 * step)));
  values.insert(2, gtsam::Vector4(0.05, 0.02, -0.03, 0.01));
  EXPECT_TRUE(gtsam::internal::testFactorJacobians("factor", factor, values, 1e-6, 1e-6));
}

TEST(CompoundOdometryFactor, IsWhatItsMotionsAreTogether) {
  CompoundMotion motion;
  gtsam::NonlinearFactorGraph steps;
  const Vector4d s_0(0.004, 0.001, -0.002, 0.003);
  gtsam::Values values;
  values.insert(100, gtsam::Vector4(s_0));
  Pose T_map_body;
  values.insert(0, to_gtsam(T_map_body));
  for (int k = 1; k <= 5; ++k) {
    Vector6d step;
    step << 0.02 * k, -0.01, 0.1, 1.0, 0.1, -0.02;
    motion.append(Pose::exp(step), kOdometry, s_0);
    values.insert(k, to_gtsam(T_map_body = T_map_body * corrected(Pose::exp(step), s_0)));
    steps.emplace_shared<SystematicOdometryFactor>(k - 1, k, 100, Pose::exp(step),
                                                   gtsam::noiseModel::Gaussian::Covariance(kOdometry));
  }
  const auto noise = gtsam::noiseModel::Gaussian::Covariance(motion.covariance);
  const CompoundOdometryFactor factor(0, 5, 100, motion.T_a_b, motion.by_systematic, s_0, noise);
  EXPECT_LT(factor.error(values), 1e-12);
  EXPECT_TRUE(gtsam::internal::testFactorJacobians("factor", factor, values, 1e-6, 1e-6));
  const gtsam::Ordering inner(gtsam::KeyVector{1, 2, 3, 4});
  const auto outer = steps.linearize(values)->eliminatePartialSequential(inner).second;
  gtsam::GaussianFactorGraph compound;
  compound.push_back(factor.linearize(values));
  const gtsam::Ordering ordering(gtsam::KeyVector{0, 5, 100});
  EXPECT_TRUE(outer->hessian(ordering).first.isApprox(compound.hessian(ordering).first, 1e-6));
}

TEST(SystematicStates, AreFoundFromLoops) {
  const auto truth = circle(400, 1.0);
  Vector4d errors(0.008, 0.0, 0.0, 4e-5);
  Random random(11);
  PoseGraph graph({.systematic = {.enabled = true, .stretch_m = 1000.0}});
  graph.add_keyframe(truth[0]);
  graph.add_prior(0, truth[0], kTight);
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const Pose step =
        corrected(truth[k - 1].inverse() * truth[k], -errors) * Pose::exp(0.02 * noise(random, kOdometry));
    graph.add_keyframe(graph.T_map_body(k - 1) * step);
    graph.add_odometry({k - 1, k, step, 0.0004 * kOdometry});
  }
  for (const std::size_t k : {100, 200, 300, 399}) graph.add_prior(k, truth[k], kLoop);
  graph.optimize();
  EXPECT_NEAR(graph.systematic_errors(200).scale, 0.008, 0.001);
  EXPECT_NEAR(graph.systematic_errors(200).rotation_rad_per_m.z(), 4e-5, 4e-6);
}

TEST(PoseGraph, KnowsTheUncertaintyBetweenKeyframesThatNoChainTies) {
  const Matrix6d sure = 1e-4 * Matrix6d::Identity(), step = 1e-2 * Matrix6d::Identity();
  const Pose forward(Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0});
  PoseGraph graph(PoseGraphOptions{});
  graph.add_keyframe(Pose());
  graph.add_prior(0, Pose(), sure);
  graph.add_keyframe(forward);
  graph.add_odometry({0, 1, forward, step});
  graph.add_keyframe(forward * forward);
  graph.add_odometry({0, 2, forward * forward, step});  // from before a loss, not from keyframe 1
  const Matrix6d between = graph.relative_covariance(1, 2);
  const std::vector<Matrix6d> each = graph.covariances({1, 2});
  const Matrix6d by_1 = forward.inverse().adjoint();
  EXPECT_LT((between - (by_1 * each[0] * by_1.transpose() + each[1])).norm(), 1e-9);
  EXPECT_LT(graph.chi_square({1, 2, forward, step}), 1e-6);
}

}  // namespace
}  // namespace demslam

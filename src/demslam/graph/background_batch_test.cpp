#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <chrono>
#include <cstring>
#include <thread>

#include "demslam/base/error.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/graph/test_paths.h"

namespace demslam {
namespace {

using namespace test;

const Matrix6d kFix = isotropic(0.02, 0.3);

std::future<void> at_once(std::function<void()> batch) {
  std::packaged_task<void()> task(std::move(batch));
  task();
  return task.get_future();
}

std::future<void> when_it_is_waited_for(std::function<void()> batch) {
  return std::async(std::launch::deferred, std::move(batch));
}

std::future<void> slowly(std::function<void()> batch) {
  return std::async(std::launch::async, [batch = std::move(batch)] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    batch();
  });
}

/// Two laps of a circle of 200 keyframes each, with an absolute fix every 40 keyframes or without, and from the second
/// lap on a loop every 10 keyframes; one of them is false. Solved as a run solves it.
class Laps {
 public:
  static constexpr std::size_t kLap = 200;

  explicit Laps(const PoseGraphOptions& options = {}, const BatchLauncher& launch = in_its_own_thread,
                bool with_fixes = true)
      : graph(options, launch), with_fixes_(with_fixes) {
    truth_ = circle(kLap + 1, 1.0);
    const auto lap = truth_;
    truth_.insert(truth_.end(), lap.begin() + 1, lap.end());
    graph.add_keyframe(truth_[0]);
    graph.add_prior(0, truth_[0], kTight);
  }

  void advance() {
    const std::size_t k = graph.size();
    const RelativePose step = between(truth_, k - 1, k, kOdometry, random_);
    graph.add_keyframe(graph.T_map_body(k - 1) * graph.corrected_odometry(step));
    graph.add_odometry(step);
    if (with_fixes_ && k % 40 == 0) graph.add_prior(k, truth_[k] * Pose::exp(noise(random_, kFix)), kFix);
  }
  void close(std::size_t i) { graph.add_loop(between(truth_, i, graph.size() - 1, kLoop, random_)); }

  /// `until`: keyframes.
  void drive(std::size_t until) {
    while (graph.size() < until) {
      advance();
      const std::size_t k = graph.size() - 1;
      const bool closes = k > kLap && k % 10 == 0;
      if (closes && k != 250) close(k - kLap);
      if (k == 250) graph.add_loop({20, k, Pose(), kLoop});
      if (closes || k % 5 == 0 || graph.batch_is_ready()) adopted_ += graph.optimize_recent().batch;
    }
  }
  int adopted() const { return adopted_; }
  const std::vector<Pose>& truth() const { return truth_; }

  PoseGraph graph;

 private:
  bool with_fixes_;
  std::vector<Pose> truth_;
  Random random_{17};
  int adopted_ = 0;
};

void expect_same_bytes(const PoseGraph& a, const PoseGraph& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(std::memcmp(a.T_map_body(k).translation().data(), b.T_map_body(k).translation().data(), 24), 0) << k;
    ASSERT_EQ(std::memcmp(a.T_map_body(k).rotation().coeffs().data(), b.T_map_body(k).rotation().coeffs().data(), 32),
              0)
        << k;
  }
  for (std::size_t l = 0; l < a.loops(); ++l) EXPECT_EQ(a.loop_is_on(l), b.loop_is_on(l)) << l;
}

double farthest_m(const PoseGraph& a, const PoseGraph& b, std::size_t end) {
  double farthest_m = 0.0;
  for (std::size_t k = 0; k < end; ++k)
    farthest_m = std::max(farthest_m, (a.T_map_body(k).inverse() * b.T_map_body(k)).log().norm());
  return farthest_m;
}

const PoseGraphOptions kRun{.systematic = {.enabled = true, .stretch_m = 50.0}, .window_m = 40.0, .batch_takes = 0.03};

TEST(BackgroundBatch, EndsInTheSameBytesHoweverFastItsThreadIs) {
  Laps first(kRun, in_its_own_thread);
  first.drive(401);
  EXPECT_GE(first.adopted(), 3);
  EXPECT_FALSE(first.graph.loop_is_on(4));
  for (const auto& launch : {BatchLauncher(at_once), BatchLauncher(when_it_is_waited_for), BatchLauncher(slowly)}) {
    Laps other(kRun, launch);
    other.drive(401);
    expect_same_bytes(first.graph, other.graph);
    EXPECT_EQ(first.graph.newest_covariance(), other.graph.newest_covariance());
  }
}

TEST(BackgroundBatch, CountsOnceThePathHasGrownByItsShare) {
  Laps laps({.window_m = 40.0, .batch_takes = 0.05}, at_once, false);
  laps.drive(211);  // the loop of keyframe 210 has begun one, at 210 m
  const double before_m = (laps.graph.T_map_body(210).translation() - laps.truth()[210].translation()).norm();
  for (const double begun_m = laps.graph.path_m(210); !laps.graph.batch_is_ready();) {
    EXPECT_LT(laps.graph.path_m(laps.graph.size() - 1), 1.05 * begun_m);
    EXPECT_FALSE(laps.graph.optimize_recent().batch);
    EXPECT_NEAR((laps.graph.T_map_body(210).translation() - laps.truth()[210].translation()).norm(), before_m, 0.1);
    laps.advance();
  }
  EXPECT_EQ(laps.graph.batches(), 0U);
  EXPECT_TRUE(laps.graph.optimize_recent().batch);
  EXPECT_EQ(laps.graph.batches(), 1U);
  EXPECT_LT((laps.graph.T_map_body(210).translation() - laps.truth()[210].translation()).norm(), 0.3 * before_m);
}

TEST(BackgroundBatch, CountsAtTheNextKeyframeOfAShortPath) {
  Laps laps({.batch_takes = 0.004}, in_its_own_thread, false);  // 0.84 m of 210 m
  laps.drive(211);
  EXPECT_FALSE(laps.graph.batch_is_ready());
  laps.drive(212);
  EXPECT_EQ(laps.adopted(), 1);
}

TEST(BackgroundBatch, PutsEverythingWhereABatchOfThatMomentWould) {
  Laps beside(kRun, at_once), at_once_(kRun, at_once);
  beside.drive(211);
  at_once_.drive(211);
  at_once_.graph.optimize();
  while (!beside.graph.batch_is_ready()) beside.advance();
  beside.graph.optimize_recent();
  EXPECT_LT(farthest_m(beside.graph, at_once_.graph, 211), 2e-3);
  EXPECT_NEAR(beside.graph.systematic_errors(100).scale, at_once_.graph.systematic_errors(100).scale, 1e-5);
}

TEST(BackgroundBatch, LaterKeyframesMoveAlong) {
  Laps laps({.window_m = 40.0, .batch_takes = 0.05}, in_its_own_thread, false);
  laps.drive(211);
  while (!laps.graph.batch_is_ready()) laps.advance();
  const Pose T_then_now = laps.graph.T_map_body(210).inverse() * laps.graph.T_map_body(laps.graph.size() - 1);
  const Pose before = laps.graph.T_map_body(laps.graph.size() - 1);
  laps.graph.optimize_recent();
  const Pose after = laps.graph.T_map_body(laps.graph.size() - 1);
  EXPECT_GT((before.inverse() * after).log().norm(), 0.3);
  EXPECT_LT(((laps.graph.T_map_body(210) * T_then_now).inverse() * after).log().norm(), 1e-3);
}

TEST(BackgroundBatch, TheRunGoesOnFromItAsFromABatch) {
  for (const bool with_fixes : {false, true}) {
    Laps laps({.window_m = 40.0, .batch_takes = 0.1}, in_its_own_thread, with_fixes);
    while (laps.adopted() == 0) laps.drive(laps.graph.size() + 1);
    for (int k = 0; k < 60; ++k) {
      laps.advance();
      laps.graph.optimize_recent();
    }
    const std::size_t newest = laps.graph.size() - 1;
    const Pose before = laps.graph.T_map_body(newest);
    const Matrix6d covariance = laps.graph.newest_covariance();
    laps.graph.optimize();
    const Vector6d difference = (before.inverse() * laps.graph.T_map_body(newest)).log();
    EXPECT_LT(difference.dot(covariance.ldlt().solve(difference)), 0.1);
    EXPECT_TRUE(covariance.isApprox(laps.graph.covariances({newest}).front(), 0.1));
  }
}

TEST(BackgroundBatch, ALoopOntoAFoldedKeyframeMeanwhileWaitsForTheNext) {
  Laps laps(kRun), all_at_once({.systematic = kRun.systematic, .batch_every = 1e9});
  laps.drive(211);
  ASSERT_FALSE(laps.graph.batch_is_ready());
  laps.advance();
  laps.close(11);
  while (laps.graph.batches() == 0) {
    laps.advance();
    laps.graph.optimize_recent();
  }
  EXPECT_TRUE(laps.graph.loop_is_on(1));
  while (all_at_once.graph.size() < laps.graph.size()) {
    all_at_once.advance();
    if (all_at_once.graph.size() == 211) all_at_once.close(10);
    if (all_at_once.graph.size() == 212) all_at_once.close(11);
  }
  laps.graph.optimize();
  all_at_once.graph.optimize();
  EXPECT_LT(laps.graph.variables(), all_at_once.graph.variables());
  EXPECT_LT(farthest_m(laps.graph, all_at_once.graph, laps.graph.size()), 2e-3);
}

TEST(BackgroundBatch, LoopsAreSwitchedWhenItCounts) {
  Laps laps({.window_m = 40.0, .batch_takes = 0.02}, at_once, false);
  laps.drive(201);
  for (const std::size_t k : {1, 2, 3, 4}) {
    laps.advance();
    k == 3 ? (void)laps.graph.add_loop({3, 203, Pose(Eigen::Quaterniond::Identity(), {0.0, 1.5, 0.0}), kLoop})
           : laps.close(k);
  }
  EXPECT_FALSE(laps.graph.optimize_recent().batch);
  while (!laps.graph.batch_is_ready()) {
    EXPECT_TRUE(laps.graph.loop_is_on(2));
    laps.advance();
  }
  EXPECT_EQ(laps.graph.optimize_recent().loops_switched, 1);
  EXPECT_FALSE(laps.graph.loop_is_on(2));
  EXPECT_TRUE(laps.graph.loop_is_on(1));
}

TEST(BackgroundBatch, IsDroppedWhenTheGraphIsMoved) {
  const Pose aside(Eigen::Quaterniond::Identity(), {3.0, 0.0, 0.0});
  Laps a(kRun, in_its_own_thread), b(kRun, when_it_is_waited_for);
  for (Laps* laps : {&a, &b}) {
    laps->drive(211);
    laps->graph.move(100, aside);
    while (laps->graph.size() < 230) laps->advance();
    EXPECT_FALSE(laps->graph.batch_is_ready());
    EXPECT_EQ(laps->graph.batches(), 0U);
  }
  expect_same_bytes(a.graph, b.graph);
}

TEST(BackgroundBatch, IsWhereABatchOverEverythingBegins) {
  Laps laps(kRun), clean(kRun, when_it_is_waited_for);
  for (Laps* each : {&laps, &clean}) {
    each->drive(211);
    each->advance();
    each->graph.optimize();
    EXPECT_FALSE(each->graph.batch_is_ready());
  }
  expect_same_bytes(laps.graph, clean.graph);
  EXPECT_EQ(laps.graph.batches(), 2U);
}

TEST(BackgroundBatch, WhatItThrowsComesOutWhereItWouldHaveCounted) {
  Laps laps(kRun, [](const std::function<void()>&) { return at_once([] { throw Error("no memory"); }); });
  laps.drive(211);
  while (!laps.graph.batch_is_ready()) {
    laps.advance();
    EXPECT_NO_THROW(laps.graph.optimize_window(200));
  }
  EXPECT_THAT([&] { laps.graph.optimize_recent(); }, testing::ThrowsMessage<Error>("no memory"));
}

TEST(BackgroundBatch, AGraphTakesItAlongAndWaitsForIt) {
  Laps stays(kRun, slowly), goes(kRun, slowly);
  stays.drive(211);
  goes.drive(211);
  Laps moved = std::move(goes);
  moved.drive(221);
  stays.drive(221);
  EXPECT_GT(moved.adopted(), 0);
  expect_same_bytes(moved.graph, stays.graph);
  Laps given_up(kRun, slowly);
  given_up.drive(211);
}

}  // namespace
}  // namespace demslam

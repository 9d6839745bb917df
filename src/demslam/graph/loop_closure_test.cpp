#include "demslam/graph/loop_closure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

const Pose kBodyLeft(R_body_camera_level(), Eigen::Vector3d(1.0, 0.15, 1.5));

Matrix6d isotropic(double sigma_rad, double sigma_m) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(sigma_rad * sigma_rad), Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variance.asDiagonal();
}

/// A square of 40 m driven clockwise, keyframes every 2 m; the odometry turns 0.0005 rad too little at every step.
class Square : public testing::Test {
 protected:
  Square() {
    truth_.emplace_back();
    graph_.add_keyframe(truth_[0]);
    graph_.add_prior(0, truth_[0], isotropic(1e-4, 1e-3));
    for (int side = 0; side < 4; ++side) {
      for (int k = 0; k < 20; ++k) advance(k == 19 ? -M_PI / 2 : 0.0);
    }
  }

  void advance(double turn) {
    Vector6d drift = Vector6d::Zero();
    drift[2] = 5e-4;
    const Pose step(rotation_from_rpy(0.0, 0.0, turn), Eigen::Vector3d(2.0, 0.0, 0.0));
    truth_.push_back(truth_.back() * step);
    const Pose measured = step * Pose::exp(drift);
    const std::size_t k = graph_.add_keyframe(graph_.T_map_body(graph_.size() - 1) * measured);
    graph_.add_odometry({k - 1, k, measured, isotropic(0.002, 0.02)});
  }

  /// The motion a perfect camera would see, between left cameras.
  Motion seen(std::size_t i, std::size_t j) const {
    return {.ok = true,
            .T_a_b = kBodyLeft.inverse() * truth_[i].inverse() * truth_[j] * kBodyLeft,
            .covariance = isotropic(1e-3, 1e-2),
            .inliers = 100};
  }

  std::vector<Pose> truth_;
  PoseGraph graph_;
};

TEST_F(Square, ClosesWhereItStartedOnceThreeKeyframesAgree) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) { return seen(i, j); });
  const auto first = closure.close(graph_);
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(first.front().status, LoopStatus::unconfirmed);
  EXPECT_EQ(first.front().measurement.j, 80U);
  EXPECT_LE(first.front().measurement.i, 3U);
  advance(0.0);
  closure.close(graph_);
  EXPECT_EQ(graph_.loops(), 0U);
  advance(0.0);
  const auto last = closure.close(graph_);
  EXPECT_EQ(std::ranges::count(last, LoopStatus::accepted, &LoopResult::status), 9);
  EXPECT_EQ(closure.counters().accepted, 9);
  EXPECT_EQ(graph_.loops(), 1U);
  const double before_m = (graph_.T_map_body(80).translation() - truth_[80].translation()).norm();
  graph_.optimize();
  EXPECT_LT((graph_.T_map_body(80).translation() - truth_[80].translation()).norm(), 0.2 * before_m);
}

TEST_F(Square, OneViewTakenForAnotherClosesNoLoop) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) {
    return j == 81 ? seen(i, j) : Motion{.reason = "too few matches (3)"};
  });
  for (int k = 0; k < 15; ++k) {
    closure.close(graph_);
    advance(0.0);
  }
  EXPECT_EQ(graph_.loops(), 0U);
  EXPECT_EQ(closure.counters().rejected, closure.counters().verified);
  EXPECT_GT(closure.counters().verified, 0);
}

TEST_F(Square, LoopsThatDisagreeDoNotConfirmEachOther) {
  Random random(3);
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) {
    Motion wrong = seen(i, j);
    Vector6d off;
    off << 0.0, 0.05 * random.normal(), 0.0, 0.8 * random.normal(), 0.0, 0.8 * random.normal();
    wrong.T_a_b = wrong.T_a_b * Pose::exp(off);
    return wrong;
  });
  int plausible = 0;
  for (int k = 0; k < 10; ++k) {
    for (const LoopResult& result : closure.close(graph_)) plausible += result.status == LoopStatus::unconfirmed;
    advance(0.0);
  }
  EXPECT_GT(plausible, 3);
  EXPECT_EQ(graph_.loops(), 0U);
}

TEST_F(Square, AFalseGroupIsSwitchedOffOnceTrueOnesOutnumberIt) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) {
    Motion motion = seen(i, j);
    const Pose aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.5));
    if (j <= 82) motion.T_a_b = motion.T_a_b * aside;  // the first views show a place that only looks alike
    return motion;
  });
  std::vector<LoopResult> changed;
  for (int k = 0; k < 20; ++k) {
    for (const LoopResult& result : closure.close(graph_)) {
      if (result.status == LoopStatus::switched_off) changed.push_back(result);
    }
    graph_.optimize_recent();
    EXPECT_EQ(graph_.loops(), k < 2 ? 0U : k < 5 ? 1U : graph_.loops());
    advance(0.0);
  }
  EXPECT_EQ(changed.size(), 9U);
  EXPECT_EQ(closure.counters().rejected_later, 9);
  graph_.optimize();
  closure.review(graph_);
  EXPECT_EQ(closure.counters().rejected_later, 9);
  EXPECT_LT((graph_.T_map_body(80).translation() - truth_[80].translation()).norm(), 0.1);
}

TEST_F(Square, WhenThePositionSaysTooLittleItAsksTheAppearance) {
  std::vector<std::size_t> asked;
  LoopClosure closure(
      {.radius_m = 0.1, .max_radius_m = 0.1}, kBodyLeft,
      [&](std::size_t i, std::size_t, const Pose&) {
        asked.push_back(i);
        return Motion{};
      },
      [](std::size_t keyframe, std::size_t) { return std::vector<std::size_t>{7, keyframe - 1, 12}; });
  closure.close(graph_);
  EXPECT_THAT(asked, testing::ElementsAre(7, 12));
}

TEST_F(Square, TheGuessIsInCameraFrames) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose& guess) {
    const Pose expected = kBodyLeft.inverse() * graph_.T_map_body(i).inverse() * graph_.T_map_body(j) * kBodyLeft;
    EXPECT_LT((expected.inverse() * guess).log().norm(), 1e-9);
    return Motion{.reason = "too few matches (3)"};
  });
  const auto results = closure.close(graph_);
  ASSERT_FALSE(results.empty());
  EXPECT_EQ(results.front().reason, "too few matches (3)");
  EXPECT_EQ(graph_.loops(), 0U);
}

TEST_F(Square, RefusesWhatTheGraphCannotBelieve) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) {
    Motion wrong = seen(i, j);
    wrong.T_a_b = wrong.T_a_b * Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 9.0));
    return wrong;
  });
  for (const LoopResult& result : closure.close(graph_)) {
    EXPECT_EQ(result.status, LoopStatus::inconsistent);
    EXPECT_THAT(result.reason, testing::HasSubstr("chi-square"));
  }
  EXPECT_EQ(graph_.loops(), 0U);
  EXPECT_EQ(closure.counters().rejected, closure.counters().proposed);
  EXPECT_GT(closure.counters().proposed, 0);
}

TEST_F(Square, AsksNothingOfFreshOrOppositeKeyframes) {
  int asked = 0;
  const auto count = [&](std::size_t, std::size_t, const Pose&) {
    ++asked;
    return Motion{};
  };
  LoopClosure({.min_path_m = 1000.0}, kBodyLeft, count).close(graph_);
  EXPECT_EQ(asked, 0);
  advance(M_PI);
  advance(0.0);  // now driving back along the last side
  LoopClosure({.min_path_m = 20.0, .max_heading_difference_deg = 20.0}, kBodyLeft, count).close(graph_);
  EXPECT_EQ(asked, 0);
}

}  // namespace
}  // namespace demslam

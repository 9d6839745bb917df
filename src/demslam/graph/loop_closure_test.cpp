#include "demslam/graph/loop_closure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

TEST_F(Square, ClosesWhereItStarted) {
  LoopClosure closure({}, kBodyLeft, [&](std::size_t i, std::size_t j, const Pose&) { return seen(i, j); });
  const auto results = closure.close(graph_);
  ASSERT_FALSE(results.empty());
  EXPECT_EQ(results.front().status, LoopStatus::accepted);
  EXPECT_EQ(results.front().measurement.j, 80U);
  EXPECT_LE(results.front().measurement.i, 3U);
  const double before_m = (graph_.T_map_body(80).translation() - truth_[80].translation()).norm();
  graph_.optimize();
  EXPECT_LT((graph_.T_map_body(80).translation() - truth_[80].translation()).norm(), 0.2 * before_m);
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

#include "demslam/evaluation/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr TimestampNs kSecond = 1'000'000'000;

/// A drive of 40 m along an L, one pose per second and metre, turning at the corner.
Trajectory l_shaped() {
  Trajectory trajectory;
  for (int i = 0; i <= 40; ++i) {
    const Eigen::Vector3d p(std::min(i, 20), std::max(i - 20, 0), 0.1 * std::sin(i));
    trajectory.push_back({i * kSecond, Pose(rotation_from_rpy(0.0, 0.0, i < 20 ? 0.0 : 1.5), p)});
  }
  return trajectory;
}

Trajectory moved(Trajectory trajectory, const Pose& T) {
  for (StampedPose& stamped : trajectory) stamped.pose = T * stamped.pose;
  return trajectory;
}

TEST(Evaluate, TheTruthItselfHasNoError) {
  const Evaluation e = evaluate(l_shaped(), l_shaped());
  EXPECT_EQ(e.poses, 41U);
  EXPECT_EQ(e.ate.rmse, 0.0);
  EXPECT_NEAR(e.rpe->rmse, 0.0, 1e-12);
  EXPECT_EQ(e.completion, 1.0);
  EXPECT_NEAR(e.path_length_m, path_length_m(l_shaped()), 1e-12);
  EXPECT_TRUE(e.notes.empty());
}

TEST(Evaluate, AShiftSplitsIntoHorizontalAndVertical) {
  const Evaluation e = evaluate(l_shaped(), moved(l_shaped(), Pose(Eigen::Quaterniond::Identity(), {3.0, 4.0, -12.0})));
  EXPECT_NEAR(e.ate.rmse, 13.0, 1e-12);
  EXPECT_NEAR(e.ate_horizontal.rmse, 5.0, 1e-12);
  EXPECT_NEAR(e.ate_vertical.rmse, 12.0, 1e-12);
  EXPECT_NEAR(e.ate_star, 13.0 / e.path_length_m, 1e-12);
  EXPECT_NEAR(e.drift_percent, 1300.0 / e.path_length_m, 1e-9);
  EXPECT_NEAR(e.ate_se3->rmse, 0.0, 1e-9);
  EXPECT_NEAR(e.errors.back().distance_m, e.path_length_m, 1e-12);
  EXPECT_TRUE(e.errors[7].error_m.isApprox(Eigen::Vector3d(3.0, 4.0, -12.0), 1e-12));
}

TEST(Evaluate, EachAlignmentUndoesWhatItIsFor) {
  Trajectory scaled = l_shaped();
  for (StampedPose& stamped : scaled) stamped.pose = Pose(stamped.pose.rotation(), 1.25 * stamped.pose.translation());
  const Pose T(rotation_from_rpy(0.2, -0.1, 1.0), {5.0, 6.0, 7.0});
  const Evaluation rigid = evaluate(l_shaped(), moved(l_shaped(), T));
  EXPECT_GT(rigid.ate_unaligned->rmse, 5.0);
  EXPECT_NEAR(rigid.ate_first_pose->rmse, 0.0, 1e-9);
  EXPECT_NEAR(rigid.ate_se3->rmse, 0.0, 1e-9);
  const Evaluation similar = evaluate(l_shaped(), moved(scaled, T), {.alignment = Alignment::sim3});
  EXPECT_GT(similar.ate_se3->rmse, 0.5);
  EXPECT_NEAR(similar.ate.rmse, 0.0, 1e-9);
  EXPECT_NEAR(*similar.sim3_scale, 0.8, 1e-9);
}

TEST(Evaluate, ThePathIsMeasuredAtTheTruthsOwnRate) {
  Trajectory sparse;
  for (const StampedPose& pose : l_shaped()) {
    if (pose.t_ns % (10 * kSecond) == 0) sparse.push_back(pose);
  }
  EXPECT_NEAR(evaluate(l_shaped(), sparse).path_length_m, path_length_m(l_shaped()), 1e-12);
}

TEST(Evaluate, CompletionCountsFramesWhereTheyAreKnown) {
  Trajectory half = l_shaped();
  half.resize(20);
  std::vector<TimestampNs> frames;
  for (int i = 0; i < 25; ++i) frames.push_back(i * kSecond);
  EXPECT_DOUBLE_EQ(evaluate(l_shaped(), half, {.frame_stamps = frames}).completion, 0.8);
}

TEST(Evaluate, CompletionOtherwiseIsTheShareOfTimeWithoutTheGaps) {
  Trajectory gappy = l_shaped();
  gappy.erase(gappy.begin() + 11, gappy.begin() + 20);  // nothing between 10 s and 20 s
  EXPECT_DOUBLE_EQ(evaluate(l_shaped(), gappy).completion, 0.75);
}

TEST(Evaluate, PositionsAloneRefuseWhatNeedsOrientation) {
  Trajectory truth = l_shaped();
  for (StampedPose& stamped : truth) stamped.pose = Pose(Eigen::Quaterniond::Identity(), stamped.pose.translation());
  const Evaluation e = evaluate(truth, l_shaped());
  EXPECT_FALSE(e.rpe_rotation_deg);
  EXPECT_FALSE(e.ate_first_pose);
  EXPECT_NEAR(e.rpe->rmse, 0.0, 1e-12);
  EXPECT_THAT(e.notes,
              testing::ElementsAre(HasSubstr("first pose aligned is not determined: the truth has positions only"),
                                   HasSubstr("RPE rotation is refused: the truth has positions only")));
  EXPECT_THAT([&] { evaluate(truth, l_shaped(), {.alignment = Alignment::first_pose}); },
              ThrowsMessage<Error>(HasSubstr("the truth has positions only")));
}

TEST(Evaluate, AStraightLineHasNoUmeyamaAlignment) {
  Trajectory line = l_shaped();
  line.resize(10);
  for (StampedPose& stamped : line)
    stamped.pose = Pose(stamped.pose.rotation(), {stamped.pose.translation().x(), 0.0, 0.0});
  EXPECT_FALSE(evaluate(line, line).ate_se3);
  EXPECT_THAT([&] { evaluate(line, line, {.alignment = Alignment::se3}); },
              ThrowsMessage<Error>(HasSubstr("SE(3) Umeyama alignment is not determined")));
}

TEST(Evaluate, ARoverThatStandsHasNoRelativeFigures) {
  const Trajectory standing = {{0, Pose()}, {kSecond, Pose()}};
  const Evaluation e = evaluate(standing, standing);
  EXPECT_TRUE(std::isnan(e.ate_star));
  EXPECT_TRUE(nlohmann::json::parse(evaluation_json(e))["drift_percent"].is_null());
}

TEST(Evaluate, ATrajectoryTooShortForTheDeltaIsNoted) {
  const Evaluation e = evaluate(l_shaped(), l_shaped(), {.rpe = {.delta = 100.0, .unit = DeltaUnit::metres}});
  EXPECT_FALSE(e.rpe);
  EXPECT_THAT(e.notes,
              testing::ElementsAre(HasSubstr("RPE over 100 m, consecutive pairs: the trajectory is too short")));
}

TEST(EvaluationJson, HasWhatEveryRunIsComparedBy) {
  const auto json =
      nlohmann::json::parse(evaluation_json(evaluate(l_shaped(), l_shaped(), {.alignment = Alignment::se3})));
  for (const char* key : {"ate_rmse_m", "ate_se3_rmse_m", "ate_sim3_rmse_m", "ate_first_pose_rmse_m", "ate_star",
                          "ate_horizontal_rmse_m", "ate_vertical_rmse_m", "rpe_rmse_m", "rpe_rotation_rmse_deg",
                          "drift_percent", "completion", "path_length_m", "poses"}) {
    EXPECT_TRUE(json.contains(key) && json[key].is_number()) << key;
  }
  EXPECT_EQ(json["alignment"], "se3");
  EXPECT_EQ(json["rpe"], "over 1 frame, consecutive pairs");
}

}  // namespace
}  // namespace demslam

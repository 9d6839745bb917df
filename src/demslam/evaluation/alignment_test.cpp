#include "demslam/evaluation/alignment.h"

#include <gtest/gtest.h>

#include "demslam/base/random.h"

namespace demslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

const Points kCorner = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};

Points moved(const Points& points, const Similarity& S) {
  Points result;
  for (const Eigen::Vector3d& p : points) result.push_back(S * p);
  return result;
}

const Similarity kTruth{rotation_from_rpy(0.5, -0.3, 2.0).toRotationMatrix(), {10.0, -5.0, 2.0}, 1.7};

TEST(Umeyama, FindsASimilarityExactly) {
  const auto S = umeyama(kCorner, moved(kCorner, kTruth), true);
  ASSERT_TRUE(S);
  EXPECT_NEAR(S->scale, 1.7, 1e-12);
  EXPECT_TRUE(S->R.isApprox(kTruth.R, 1e-12));
  EXPECT_TRUE(S->t.isApprox(kTruth.t, 1e-12));
}

TEST(Umeyama, WithoutScaleItStaysRigid) {
  const auto S = umeyama(kCorner, moved(kCorner, kTruth), false);
  ASSERT_TRUE(S);
  EXPECT_DOUBLE_EQ(S->scale, 1.0);
  EXPECT_TRUE(S->R.isApprox(kTruth.R, 1e-9));
}

TEST(Umeyama, APlaneIsNeverMirrored) {
  const Points plane = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 1, 0}};
  const auto S = umeyama(plane, moved(plane, kTruth), false);
  ASSERT_TRUE(S);
  EXPECT_NEAR(S->R.determinant(), 1.0, 1e-12);
  const Points mirrored = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -3}};
  EXPECT_NEAR(umeyama(kCorner, mirrored, false)->R.determinant(), 1.0, 1e-12);
}

TEST(Umeyama, PointsOnALineOrInOnePlaceDetermineNothing) {
  const Points line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const Points place(3, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_FALSE(umeyama(line, line, false));
  EXPECT_FALSE(umeyama(place, place, true));
  EXPECT_FALSE(umeyama({line[0]}, {line[0]}, false));
}

TEST(Align, FirstPoseMovesTheFirstPoseOntoTheTruth) {
  const Pose offset(rotation_from_rpy(0.1, 0.2, 0.3), {4.0, 5.0, 6.0});
  PosePairs pairs;
  for (int i = 0; i < 3; ++i) {
    const Pose pose(rotation_from_rpy(0.0, 0.1, 0.2 * i + 0.1), {1.0 * i, 0.0, 0.0});
    pairs.truth.push_back({i, pose});
    pairs.estimate.push_back({i, offset * pose});
  }
  const auto S = align(pairs, Alignment::first_pose);
  ASSERT_TRUE(S);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d aligned = *S * pairs.estimate[i].pose.translation();
    EXPECT_NEAR((aligned - pairs.truth[i].pose.translation()).norm(), 0.0, 1e-12);
  }
}

TEST(Align, FirstPoseNeedsATruthWithRotations) {
  PosePairs pairs;
  pairs.truth = {{0, Pose()}, {1, Pose(Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0})}};
  pairs.estimate = pairs.truth;
  EXPECT_FALSE(align(pairs, Alignment::first_pose));
  EXPECT_TRUE(align(pairs, Alignment::none));
}

}  // namespace
}  // namespace demslam

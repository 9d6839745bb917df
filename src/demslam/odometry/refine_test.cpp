#include "demslam/odometry/refine.h"

#include <gtest/gtest.h>

#include "demslam/odometry/ransac.h"
#include "demslam/odometry/synthetic_scene.h"

namespace demslam {
namespace {

using testing_scene::random_correspondences;
using testing_scene::test_rig;

const StereoNoise kNoise{.a = {0.5, 0.5, 0.25}, .b = {0.5, 0.5, 0.25}};
const StereoNoise kNoNoise{.a = Eigen::Vector3d::Zero(), .b = Eigen::Vector3d::Zero()};

Pose motion() { return Pose(rotation_from_rpy(0.03, -0.05, 0.02), {0.1, -0.05, 0.6}); }

Vector6d error_of(const Pose& estimate, const Pose& truth) { return (truth.inverse() * estimate).log(); }

TEST(TransferError, AnalyticJacobianIsTheNumericOne) {
  Random random(1);
  const RectifiedRig rig = test_rig();
  for (const Correspondence& c : random_correspondences(rig, motion(), kNoise, 5, random)) {
    const TransferError at = transfer_error(rig, c, kNoise, motion());
    for (int k = 0; k < 6; ++k) {
      const double h = 1e-6;
      const Vector6d step = h * Vector6d::Unit(k);
      const Eigen::Vector3d numeric = (transfer_error(rig, c, kNoise, motion() * Pose::exp(step)).error -
                                       transfer_error(rig, c, kNoise, motion() * Pose::exp(-step)).error) /
                                      (2.0 * h);
      EXPECT_LT((numeric - at.jacobian.col(k)).norm(), 1e-5 * (1.0 + numeric.norm())) << k;
    }
  }
}

TEST(StereoGeometry, UnprojectionJacobianIsTheInverseOfTheProjectionJacobian) {
  const RectifiedRig rig = test_rig();
  const StereoPixel pixel(40.0, 200.0, 7.0);
  const Eigen::Matrix3d product = projection_jacobian(rig, unproject(rig, pixel)) * unprojection_jacobian(rig, pixel);
  EXPECT_TRUE(product.isApprox(Eigen::Matrix3d::Identity(), 1e-12));
  EXPECT_TRUE(project(rig, unproject(rig, pixel)).isApprox(pixel, 1e-12));
}

TEST(RefinePose, FindsTheExactMotionWithoutNoise) {
  Random random(2);
  const RectifiedRig rig = test_rig();
  const auto correspondences = random_correspondences(rig, motion(), kNoNoise, 50, random);
  const Pose start = motion() * Pose(rotation_from_rpy(0.02, 0.02, -0.02), {0.1, 0.05, -0.1});
  const auto refined = refine_pose(rig, correspondences, kNoise, start);
  ASSERT_TRUE(refined);
  EXPECT_LT(error_of(refined->T_a_b, motion()).norm(), 1e-8);
  EXPECT_EQ(refined->inliers, 50);
}

TEST(RefinePose, ABiasOfFarDisparitiesHardlyReachesTheMotion) {
  Random random(7);
  const RectifiedRig rig = test_rig();
  auto correspondences = random_correspondences(rig, motion(), kNoNoise, 200, random);
  const double far_px = rig.disparity_px(8.0);  // the points are 3 to 25 m away
  for (Correspondence& c : correspondences) {
    if (c.a.z() < far_px) c.a.z() += 0.5, c.b.z() += 0.5;
  }
  StereoNoise knows_far = kNoise;
  knows_far.far_disparity_px = far_px;
  knows_far.far_sigma_px = 10.0;
  const auto misled = refine_pose(rig, correspondences, kNoise, motion());
  const auto refined = refine_pose(rig, correspondences, knows_far, motion());
  ASSERT_TRUE(misled && refined);
  EXPECT_LT(error_of(refined->T_a_b, motion()).norm(), 0.5 * error_of(misled->T_a_b, motion()).norm());
}

TEST(RefinePose, CovarianceIsTheScatterOfItsEstimates) {
  const RectifiedRig rig = test_rig();
  const int runs = 400;
  Matrix6d scatter = Matrix6d::Zero(), claimed = Matrix6d::Zero();
  double nees = 0.0;
  for (int run = 0; run < runs; ++run) {
    Random random(3, run);
    const auto refined = refine_pose(rig, random_correspondences(rig, motion(), kNoise, 120, random), kNoise, motion());
    ASSERT_TRUE(refined);
    const Vector6d error = error_of(refined->T_a_b, motion());
    scatter += error * error.transpose() / runs;
    claimed += refined->covariance / runs;
    nees += error.dot(refined->covariance.ldlt().solve(error)) / runs;
  }
  // Six degrees of freedom; the robust weights lose a few per cent of efficiency.
  EXPECT_GT(nees, 5.0);
  EXPECT_LT(nees, 7.5);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(std::sqrt(scatter(k, k) / claimed(k, k)), 1.0, 0.2) << k;
}

TEST(RefinePose, CovarianceGrowsWhereTheDataScatterMoreThanAssumed) {
  Random random(4);
  const RectifiedRig rig = test_rig();
  StereoNoise optimistic = kNoise;
  optimistic.a /= 1.7;
  optimistic.b /= 1.7;
  const auto correspondences = random_correspondences(rig, motion(), kNoise, 200, random);
  const auto honest = refine_pose(rig, correspondences, kNoise, motion());
  const auto raised = refine_pose(rig, correspondences, optimistic, motion());
  ASSERT_TRUE(honest && raised);
  EXPECT_GT(raised->covariance.trace(), 0.6 * honest->covariance.trace());
}

TEST(RefinePose, IgnoresFarOutliersAndPointsWithoutADisparityInB) {
  Random random(5);
  const RectifiedRig rig = test_rig();
  auto correspondences = random_correspondences(rig, motion(), kNoNoise, 60, random);
  for (int i = 0; i < 15; ++i) correspondences[i].b.head<2>() += Eigen::Vector2d(60.0, -45.0);
  for (int i = 15; i < 30; ++i) correspondences[i].b.z() = 0.0;
  const auto refined = refine_pose(rig, correspondences, kNoise, motion());
  ASSERT_TRUE(refined);
  EXPECT_EQ(refined->inliers, 45);
  EXPECT_LT(error_of(refined->T_a_b, motion()).norm(), 2e-3);
}

TEST(RefinePose, HasNoAnswerForTooFewPoints) {
  Random random(6);
  const RectifiedRig rig = test_rig();
  EXPECT_FALSE(refine_pose(rig, random_correspondences(rig, motion(), kNoNoise, 1, random), kNoise, motion()));
  EXPECT_FALSE(refine_pose(rig, {}, kNoise, motion()));
}

TEST(FindPose, SurvivesFortyPerCentOutliers) {
  Random random(7);
  const RectifiedRig rig = test_rig();
  auto correspondences = random_correspondences(rig, motion(), kNoise, 150, random);
  for (int i = 0; i < 60; ++i) {
    correspondences[i].b = {random.uniform(0.0, 320.0), random.uniform(0.0, 240.0), random.uniform(1.0, 30.0)};
  }
  const auto pose = find_pose(rig, correspondences, {});
  ASSERT_TRUE(pose);
  const auto refined = refine_pose(rig, correspondences, kNoise, *pose);
  ASSERT_TRUE(refined);
  EXPECT_NEAR(refined->inliers, 90, 6);
  const Vector6d error = error_of(refined->T_a_b, motion());
  EXPECT_LT(error.dot(refined->covariance.ldlt().solve(error)), 22.5);  // 99.9 %
}

TEST(FindPose, RepeatsItselfBitForBit) {
  Random random(8);
  const RectifiedRig rig = test_rig();
  auto correspondences = random_correspondences(rig, motion(), kNoise, 100, random);
  for (int i = 0; i < 50; ++i) correspondences[i].b.x() += random.uniform(-80.0, 80.0);
  const auto once = find_pose(rig, correspondences, {}), again = find_pose(rig, correspondences, {});
  ASSERT_TRUE(once && again);
  EXPECT_EQ(once->matrix(), again->matrix());
}

TEST(FindPose, RefusesPureNoise) {
  Random random(9);
  const RectifiedRig rig = test_rig();
  auto correspondences = random_correspondences(rig, motion(), kNoise, 60, random);
  for (auto& c : correspondences) {
    c.b = {random.uniform(0.0, 320.0), random.uniform(0.0, 240.0), random.uniform(1.0, 30.0)};
  }
  EXPECT_FALSE(find_pose(rig, correspondences, {}));
}

}  // namespace
}  // namespace demslam

#include "demslam/graph/odometry_chain.h"

#include <gtest/gtest.h>

#include "demslam/graph/test_paths.h"

namespace demslam {
namespace {

using namespace test;

OdometryChain chain_along(const std::vector<Pose>& truth) {
  OdometryChain chain;
  chain.add_keyframe();
  for (std::size_t k = 1; k < truth.size(); ++k) {
    chain.add_keyframe();
    chain.link(truth[k - 1].inverse() * truth[k], kOdometry);
  }
  return chain;
}

TEST(OdometryChain, TheCovarianceBetweenAnyTwoIsThatOfTheMotionsInBetween) {
  const OdometryChain chain = chain_along(circle(100, 1.0));
  const Matrix4d systematic = Vector4d(1e-4, 1e-8, 1e-8, 1e-8).asDiagonal();
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 99}, {3, 4}, {15, 16}, {16, 80}, {31, 33}}) {
    const CompoundMotion motion = chain.compound(a, b, Vector4d::Zero());
    const Matrix6d expected = motion.covariance + motion.by_systematic * systematic * motion.by_systematic.transpose();
    EXPECT_TRUE(chain.covariance(a, b, systematic)->isApprox(expected, 1e-6)) << a << " to " << b;
  }
}

TEST(OdometryChain, AcrossAMissingLinkItKnowsNothing) {
  OdometryChain chain = chain_along(circle(40, 1.0));
  chain.add_keyframe();
  chain.add_keyframe();
  chain.link(Pose(), kOdometry);
  EXPECT_FALSE(chain.covariance(30, 41, Matrix4d::Zero()));
  EXPECT_TRUE(chain.covariance(40, 41, Matrix4d::Zero()));
}

TEST(OdometryChain, PosesBetweenTwoFollowItsShapeAndShareTheMisfit) {
  const auto truth = circle(21, 1.0);
  const OdometryChain chain = chain_along(truth);
  const auto on_it = chain.between(0, 20, truth[0], truth[20], Vector4d::Zero());
  ASSERT_EQ(on_it.size(), 19U);
  EXPECT_LT((on_it[9].inverse() * truth[10]).log().norm(), 1e-9);
  const Pose shifted = truth[20] * Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.2));
  const auto pulled = chain.between(0, 20, truth[0], shifted, Vector4d::Zero());
  double before_m = 0.0;
  for (std::size_t n = 0; n < pulled.size(); ++n) {
    const double moved_m = (pulled[n].translation() - truth[n + 1].translation()).norm();
    EXPECT_GT(moved_m, before_m - 1e-3);
    EXPECT_LT(moved_m, 0.25);
    before_m = moved_m;
  }
}

}  // namespace
}  // namespace demslam

#include "demslam/graph/odometry_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

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

/// Of views displaced against where they should be: the mean displacement and turn, at m and in its axes.
Vector6d seen_as_a_whole(const std::vector<Pose>& truth, const std::vector<Pose>& reckoned, std::size_t m) {
  const Pose T = truth[m] * reckoned[m].inverse();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero(), shift = turn, centre = turn;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Pose displaced = T * reckoned[k];
    turn += truth[k].rotation() * (truth[k].inverse() * displaced).log().head<3>();
    shift += displaced.translation() - truth[k].translation();
    centre += truth[k].translation();
  }
  const double share = 1.0 / static_cast<double>(truth.size());
  shift += turn.cross(truth[m].translation() - share * centre);
  const Eigen::Matrix3d into_m = truth[m].rotation_matrix().transpose();
  Vector6d xi;
  xi << into_m * turn, into_m * shift;
  return share * xi;
}

TEST(OdometryChain, BendIsTheCovarianceOfWhereAStretchIsFoundAsAWhole) {
  constexpr std::size_t kMiddle = 12;
  constexpr int kWorlds = 1000;
  const auto truth = circle(40, 1.0);
  const Vector4d sigmas(5e-3, 1e-3, 1e-3, 1e-3);
  const Matrix6d bend = *chain_along(truth).bend(0, kMiddle, 39, sigmas.cwiseAbs2().asDiagonal());
  Random random(7);
  double nees = 0.0;
  for (int world = 0; world < kWorlds; ++world) {
    const Vector4d systematic =
        sigmas.cwiseProduct(Vector4d(random.normal(), random.normal(), random.normal(), random.normal()));
    std::vector<Pose> reckoned{truth[0]};
    for (std::size_t k = 1; k < truth.size(); ++k)
      reckoned.push_back(reckoned.back() * corrected(between(truth, k - 1, k, kOdometry, random).T_i_j, systematic));
    const Vector6d off = seen_as_a_whole(truth, reckoned, kMiddle);
    nees += off.dot(bend.ldlt().solve(off)) / (6.0 * kWorlds);
  }
  EXPECT_NEAR(nees, 1.0, 0.08);  // four sigmas
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

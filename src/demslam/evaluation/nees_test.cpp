#include "demslam/evaluation/nees.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/random.h"

namespace demslam {
namespace {

TEST(ChiSquareQuantile, KnowsThePrintedTables) {
  EXPECT_NEAR(chi_square_quantile(0.95, 3.0), 7.814727903, 1e-8);
  EXPECT_NEAR(chi_square_quantile(0.025, 3.0), 0.2157952826, 1e-9);
  EXPECT_NEAR(chi_square_quantile(0.975, 3.0), 9.348403604, 1e-8);
  EXPECT_NEAR(chi_square_quantile(0.5, 2.0), 1.386294361, 1e-9);
  EXPECT_NEAR(chi_square_quantile(0.975, 300.0), 349.8745, 1e-3);
}

TEST(Nees, IsTheSquaredErrorInSigmas) {
  const Nees result = nees({{2.0, 0.0, 0.0}, {0.0, 3.0, 1.0}},
                           {Eigen::Matrix3d::Identity(), Eigen::Vector3d(1.0, 9.0, 0.25).asDiagonal()});
  EXPECT_THAT(result.per_pose, testing::ElementsAre(testing::DoubleNear(4.0, 1e-12), testing::DoubleNear(5.0, 1e-12)));
  EXPECT_DOUBLE_EQ(result.mean, 4.5);
}

TEST(Nees, HonestCovariancesHaveAMeanInsideTheBand) {
  Random random(7);
  const Eigen::Matrix3d L = (Eigen::Matrix3d() << 0.5, 0, 0, 0.2, 1.0, 0, -0.1, 0.3, 2.0).finished();
  std::vector<Eigen::Vector3d> errors;
  for (int i = 0; i < 500; ++i)
    errors.push_back(L * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
  const std::vector<Eigen::Matrix3d> honest(errors.size(), L * L.transpose());
  const std::vector<Eigen::Matrix3d> too_sure(errors.size(), 0.25 * L * L.transpose());
  const Nees result = nees(errors, honest);
  EXPECT_GT(result.mean, result.lower_95);
  EXPECT_LT(result.mean, result.upper_95);
  EXPECT_NEAR(nees(errors, too_sure).mean, 4.0 * result.mean, 1e-9);
}

TEST(Nees, ACovarianceThatIsNoneIsRefused) {
  EXPECT_THROW(nees({{1.0, 0.0, 0.0}}, {-Eigen::Matrix3d::Identity()}), Error);
}

}  // namespace
}  // namespace demslam

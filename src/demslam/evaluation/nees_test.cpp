#include "demslam/evaluation/nees.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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
  EXPECT_DOUBLE_EQ(result.position.mean, 4.5);
  EXPECT_DOUBLE_EQ(result.horizontal.mean, 2.5);
  EXPECT_DOUBLE_EQ(result.vertical.mean, 2.0);
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
  EXPECT_TRUE(result.position.consistent());
  EXPECT_GT(result.position.effective_poses, 400.0);
  EXPECT_NEAR(nees(errors, too_sure).position.mean, 4.0 * result.position.mean, 1e-9);
  EXPECT_FALSE(nees(errors, too_sure).position.consistent());
}

/// Errors of unit variance with correlation rho from one pose to the next.
std::vector<Eigen::Vector3d> correlated_errors(double rho, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  const auto white = [&] { return Eigen::Vector3d(random.normal(), random.normal(), random.normal()); };
  std::vector<Eigen::Vector3d> errors{white()};
  while (errors.size() < count) errors.emplace_back(rho * errors.back() + std::sqrt(1.0 - rho * rho) * white());
  return errors;
}

TEST(Nees, TheBandHoldsNineteenOfTwentyHonestRunsHoweverCorrelatedTheirErrors) {
  for (const double rho : {0.0, 0.9, 0.99}) {
    int inside = 0;
    for (std::uint64_t run = 0; run < 100; ++run) {
      const auto errors = correlated_errors(rho, 600, run);
      inside += nees(errors, std::vector<Eigen::Matrix3d>(600, Eigen::Matrix3d::Identity())).position.consistent();
    }
    EXPECT_GE(inside, 88) << rho;
  }
}

TEST(Nees, CorrelatedErrorsAreWorthAsManyPosesAsTheirCorrelationSays) {
  const auto errors = correlated_errors(0.9, 20000, 3);
  const Nees result = nees(errors, std::vector<Eigen::Matrix3d>(errors.size(), Eigen::Matrix3d::Identity()));
  const double expected = 20000.0 * (1.0 - 0.81) / (1.0 + 0.81);  // of the squares, correlated by rho^2
  EXPECT_NEAR(result.position.effective_poses, expected, 0.35 * expected);
}

TEST(Nees, ACovarianceFourTimesTooSmallIsFoundOutInOneCorrelatedRun) {
  const auto errors = correlated_errors(0.95, 2000, 4);
  const Nees result = nees(errors, std::vector<Eigen::Matrix3d>(2000, 0.25 * Eigen::Matrix3d::Identity()));
  EXPECT_GT(result.position.mean, result.position.upper_95);
  EXPECT_THAT(describe(result), testing::HasSubstr("too sure"));
}

TEST(Nees, ErrorsInHeightAloneShowInTheVerticalPart) {
  auto errors = correlated_errors(0.5, 1000, 5);
  for (Eigen::Vector3d& error : errors) error.z() *= 4.0;
  const Nees result = nees(errors, std::vector<Eigen::Matrix3d>(1000, Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(result.horizontal.consistent());
  EXPECT_FALSE(result.vertical.consistent());
}

TEST(Nees, ACovarianceThatIsNoneIsRefused) {
  EXPECT_THROW(nees({{1.0, 0.0, 0.0}}, {-Eigen::Matrix3d::Identity()}), Error);
}

}  // namespace
}  // namespace demslam

#include "demslam/anchoring/dem_factors.h"

#include <gtest/gtest.h>
#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/nonlinear/factorTesting.h>
#include <gtsam/slam/PriorFactor.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

const Eigen::Vector3d kLever(0.3, -0.1, -1.5);
const auto kOne = gtsam::noiseModel::Unit::Create(1);
const auto kTwo = gtsam::noiseModel::Unit::Create(2);

std::shared_ptr<const Dem> plane(double slope_x, double slope_y, float hole_at_centre = 0.0F) {
  DemRaster dem{.rows = 40, .cols = 40, .cell_m = 1.0, .west_m = -20.0, .north_m = 20.0};
  for (int row = 0; row < 40; ++row) {
    for (int col = 0; col < 40; ++col) {
      const Eigen::Vector2d p = dem.centre(row, col);
      dem.heights.push_back(static_cast<float>(5.0 + slope_x * p.x() + slope_y * p.y()));
    }
  }
  dem.at(20, 20) += hole_at_centre;
  return std::make_shared<Dem>(dem);
}

std::shared_ptr<const Dem> rough() {
  DemRaster dem{.rows = 60, .cols = 60, .cell_m = 5.0, .west_m = -150.0, .north_m = 150.0};
  dem.heights.assign(3600, 0.0F);
  return std::make_shared<Dem>(perturb(dem, {.noise_m = {.rms = 4.0, .correlation_length_m = 20.0, .seed = 2}}));
}

/// A body standing on the terrain at (x, y), tilted with it, its ground point on the surface.
Pose standing(const Dem& dem, double x, double y, double yaw) {
  const DemSample s = dem.sample(x, y).value();
  const Eigen::Vector3d normal = Eigen::Vector3d(-s.gradient.x(), -s.gradient.y(), 1.0).normalized();
  const Eigen::Quaterniond R =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal) * rotation_from_rpy(0.0, 0.0, yaw);
  return Pose(R, Eigen::Vector3d(x, y, s.height_m) - R * kLever);
}

gtsam::Values at(const Pose& pose) {
  gtsam::Values values;
  values.insert(0, to_gtsam(pose));
  return values;
}

TEST(DemHeightFactor, IsZeroOnTheTerrain) {
  const auto dem = rough();
  const DemHeightFactor factor(0, dem, kLever, kOne);
  EXPECT_NEAR(factor.evaluateError(to_gtsam(standing(*dem, 12.3, -40.1, 0.7)))[0], 0.0, 1e-9);
}

TEST(DemHeightFactor, IsPositiveAboveTheTerrain) {
  const auto dem = plane(0.1, 0.0);
  const DemHeightFactor factor(0, dem, Eigen::Vector3d::Zero(), kOne);
  const Pose above(Eigen::Quaterniond::Identity(), Eigen::Vector3d(2.0, 1.0, 5.2 + 0.75));
  EXPECT_NEAR(factor.evaluateError(to_gtsam(above))[0], 0.75, 1e-5);
}

TEST(DemHeightFactor, JacobianCarriesTheSlope) {
  const DemHeightFactor factor(0, plane(0.2, -0.1), Eigen::Vector3d::Zero(), kOne);
  gtsam::Matrix H;
  factor.evaluateError(gtsam::Pose3(), H);
  const Eigen::Matrix<double, 1, 6> expected = (Eigen::Matrix<double, 1, 6>() << 0, 0, 0, -0.2, 0.1, 1.0).finished();
  EXPECT_LT((H - expected).norm(), 1e-5);
}

TEST(DemHeightFactor, PublishedFormMovesZOnly) {
  const DemHeightFactor factor(0, plane(0.2, -0.1), Eigen::Vector3d::Zero(), kOne, TerrainGradient::vertical_only);
  gtsam::Matrix H;
  factor.evaluateError(gtsam::Pose3(), H);
  EXPECT_NEAR(H.norm(), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(H(0, 5), 1.0);
}

TEST(DemHeightFactor, HasItsNumericJacobianOnASlopeAndOnRoughGroundWithALeverArm) {
  const auto ground = rough();
  for (const auto& dem : {plane(0.3, -0.2), ground}) {
    const DemHeightFactor factor(0, dem, kLever, kOne);
    Random random(3);
    for (int i = 0; i < 20; ++i) {
      Vector6d xi;
      for (int k = 0; k < 6; ++k) xi[k] = 0.3 * random.normal();
      EXPECT_TRUE(gtsam::internal::testFactorJacobians(
          "height", factor, at(standing(*dem, random.uniform(-9, 9), random.uniform(-9, 9), 1.0) * Pose::exp(xi)), 1e-6,
          1e-5));
    }
  }
}

TEST(DemHeightFactor, IsInactiveInAHoleAndOutside) {
  const auto dem = plane(0.1, 0.1, std::numeric_limits<float>::quiet_NaN());
  const DemHeightFactor height(0, dem, Eigen::Vector3d::Zero(), kOne);
  const DemNormalFactor normal(0, dem, Eigen::Vector3d::Zero(), kTwo);
  for (const double x : {0.5, 25.0}) {
    const auto values = at(Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, -0.5, 0.0)));
    EXPECT_FALSE(height.active(values));
    EXPECT_FALSE(normal.active(values));
    EXPECT_EQ(height.error(values), 0.0);
    EXPECT_EQ(height.linearize(values), nullptr);
    EXPECT_EQ(normal.linearize(values), nullptr);
  }
  EXPECT_TRUE(height.active(at(Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(10.0, 0.0, 0.0)))));
}

TEST(DemNormalFactor, IsZeroWhenStandingOnTheTerrainWhateverTheHeading) {
  const auto dem = rough();
  const DemNormalFactor factor(0, dem, kLever, kTwo);
  for (const double yaw : {-2.0, 0.0, 1.0, 3.0}) {
    EXPECT_LT(factor.evaluateError(to_gtsam(standing(*dem, 33.3, 20.1, yaw))).norm(), 1e-9);
  }
}

TEST(DemNormalFactor, MeasuresTheAngleBetweenTheNormalsAboutTheBodysAxes) {
  const DemNormalFactor factor(0, plane(0.0, 0.0), Eigen::Vector3d::Zero(), kTwo);
  const Pose rolled(rotation_from_rpy(0.1, 0.0, 2.0), Eigen::Vector3d::Zero());
  EXPECT_TRUE(factor.evaluateError(to_gtsam(rolled)).isApprox(Eigen::Vector2d(-0.1, 0.0), 1e-6));
  const Pose pitched(rotation_from_rpy(0.0, 0.2, -1.0), Eigen::Vector3d::Zero());
  EXPECT_TRUE(factor.evaluateError(to_gtsam(pitched)).isApprox(Eigen::Vector2d(0.0, -0.2), 1e-6));
}

TEST(DemNormalFactor, HasItsNumericJacobianOnASlopeAndOnRoughGroundWithALeverArm) {
  const auto ground = rough();
  for (const auto& dem : {plane(0.3, -0.2), ground}) {
    const DemNormalFactor factor(0, dem, kLever, kTwo);
    Random random(4);
    for (int i = 0; i < 20; ++i) {
      Vector6d xi;
      for (int k = 0; k < 6; ++k) xi[k] = (i < 3 ? 1e-9 : 0.3) * random.normal();
      EXPECT_TRUE(gtsam::internal::testFactorJacobians(
          "normal", factor, at(standing(*dem, random.uniform(-9, 9), random.uniform(-9, 9), 1.0) * Pose::exp(xi)), 1e-6,
          1e-5));
    }
  }
}

TEST(DemNormalFactor, StaysFiniteUpsideDown) {
  const DemNormalFactor factor(0, plane(0.0, 0.0), Eigen::Vector3d::Zero(), kTwo);
  gtsam::Matrix H;
  const Pose over(rotation_from_rpy(std::numbers::pi, 0.0, 0.0), Eigen::Vector3d::Zero());
  const gtsam::Vector error = factor.evaluateError(to_gtsam(over), H);
  EXPECT_NEAR(error.norm(), std::numbers::pi, 1e-6);
  EXPECT_TRUE(H.allFinite());
}

TEST(DemFactors, HaveTheirNumericJacobiansOnRealLunarTerrain) {
  const std::filesystem::path file = std::filesystem::path(DEMSLAM_SHARED_DIR) / "data/lunar_dtm/nac_pit_5m.tif";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "reference data missing: " << file;
  const auto dem = std::make_shared<Dem>(read_dem(file));
  const DemHeightFactor height(0, dem, kLever, kOne);
  const DemNormalFactor normal(0, dem, kLever, kTwo);
  Random random(5);
  int tested = 0;
  while (tested < 30) {
    const double x = random.uniform(-500.0, 500.0), y = random.uniform(-600.0, 600.0);
    if (!dem->covers(x, y)) continue;
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = 0.05 * random.normal();
    const auto values = at(standing(*dem, x, y, random.uniform(-3.0, 3.0)) * Pose::exp(xi));
    if (!height.active(values)) continue;
    EXPECT_TRUE(gtsam::internal::testFactorJacobians("height", height, values, 1e-6, 1e-5)) << x << " " << y;
    EXPECT_TRUE(gtsam::internal::testFactorJacobians("normal", normal, values, 1e-6, 1e-5)) << x << " " << y;
    ++tested;
  }
}

TEST(DemFactors, TogetherPullAPoseFromMetresOffOntoTheTerrain) {
  const auto dem = rough();
  const Pose truth = standing(*dem, 10.0, 15.0, 0.4);
  const auto robust = [](double sigma, int rows) {
    return gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(2.5),
                                             gtsam::noiseModel::Isotropic::Sigma(rows, sigma));
  };
  gtsam::NonlinearFactorGraph graph;
  graph.emplace_shared<DemHeightFactor>(0, dem, kLever, robust(0.5, 1));
  graph.emplace_shared<DemNormalFactor>(0, dem, kLever, robust(0.07, 2));
  gtsam::Vector6 prior;
  prior << 0.2, 0.2, 0.001, 0.1, 0.1, 100.0;  // only height, roll and pitch are open
  const DemHeightFactor plain(0, dem, kLever, kOne);
  const Pose start = truth * Pose(rotation_from_rpy(0.1, -0.1, 0.0), Eigen::Vector3d(0.0, 0.0, 8.0));
  graph.addPrior(0, to_gtsam(start), gtsam::noiseModel::Diagonal::Sigmas(prior));
  const gtsam::Values result = gtsam::LevenbergMarquardtOptimizer(graph, at(start)).optimize();
  EXPECT_GT(plain.evaluateError(to_gtsam(start))[0], 7.0);
  EXPECT_NEAR(plain.evaluateError(result.at<gtsam::Pose3>(0))[0], 0.0, 0.5);
}

}  // namespace
}  // namespace demslam

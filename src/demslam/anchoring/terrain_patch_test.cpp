#include "demslam/anchoring/terrain_patch.h"

#include <gtest/gtest.h>
#include <gtsam/base/numericalDerivative.h>

#include <cmath>
#include <functional>

#include "demslam/anchoring/patch_factor.h"
#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

std::shared_ptr<const Dem> rough() {
  DemRaster dem{.rows = 60, .cols = 60, .cell_m = 5.0, .west_m = -150.0, .north_m = 150.0};
  dem.heights.assign(3600, 0.0F);
  return std::make_shared<Dem>(perturb(dem, {.noise_m = {.rms = 4.0, .correlation_length_m = 25.0, .seed = 2}}));
}

const Pose kMiddle(rotation_from_rpy(0.05, -0.1, 0.8), Eigen::Vector3d(10.0, -20.0, 3.0));

/// Exact points of the terrain around kMiddle; every `outlier_each`-th floats 5 m above it.
std::vector<LandmarkPoint> landmarks(const Dem& dem, int count, int outlier_each = 0) {
  Random random(6);
  std::vector<LandmarkPoint> points;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d p(10.0 + random.uniform(-15.0, 15.0), -20.0 + random.uniform(-15.0, 15.0), 0.0);
    p.z() = *dem.height(p.x(), p.y()) + (outlier_each > 0 && i % outlier_each == 0 ? 5.0 : 0.0);
    points.push_back({kMiddle.inverse() * p, 0.01 * Eigen::Matrix3d::Identity()});
  }
  return points;
}

TerrainPatch patch_of(const Dem& dem, const std::vector<LandmarkPoint>& points) {
  return build_patch({{kMiddle, &points}}, 0, kMiddle, dem, {}).value();
}

TerrainPatchFactor factor_of(const TerrainPatch& patch, const std::shared_ptr<const Dem>& dem) {
  return TerrainPatchFactor(patch, dem, {}, {});
}

TEST(TerrainPatch, CellsLieOnTheTerrainTheyWereSeenOn) {
  const auto dem = rough();
  const TerrainPatch patch = patch_of(*dem, landmarks(*dem, 400));
  EXPECT_GE(patch.cells.size(), 36U);
  for (const PatchCell& cell : patch.cells) {
    const Eigen::Vector3d p = kMiddle * cell.p_body;
    EXPECT_NEAR(p.z(), *dem->height(p.x(), p.y()), 0.25);  // the curvature of the terrain within a cell
    EXPECT_GE(cell.variance_m2, 0.15 * 0.15);
  }
}

TEST(TerrainPatch, IsAsFineAsTheDemButNoFinerThanAMetre) {
  const PatchOptions asked;
  EXPECT_EQ(fitted_to(5.0, asked).cell_m, 5.0);
  EXPECT_EQ(fitted_to(20.0, asked).cell_m, 5.0);
  EXPECT_EQ(fitted_to(2.0, asked).cell_m, 2.0);
  EXPECT_EQ(fitted_to(0.25, asked).cell_m, 1.0);
  EXPECT_EQ(fitted_to(5.0, asked).sigma_relief_m, asked.sigma_relief_m);
  EXPECT_GT(fitted_to(20.0, asked).sigma_relief_m, 2.0 * asked.sigma_relief_m);
  EXPECT_NEAR(fitted_to(1.0, asked).sigma_relief_m, 0.044, 0.001);  // 0.15 / 5^0.76
  EXPECT_EQ(fitted_to(0.25, asked).sigma_relief_m, fitted_to(1.0, asked).sigma_relief_m);
}

TEST(TerrainPatch, RocksAndMismatchesAreLeftOut) {
  const auto dem = rough();
  const auto clean = patch_of(*dem, landmarks(*dem, 800)), with_rocks = patch_of(*dem, landmarks(*dem, 800, 8));
  double worst_m = 0.0;
  for (const PatchCell& cell : with_rocks.cells) {
    const Eigen::Vector3d p = kMiddle * cell.p_body;
    worst_m = std::max(worst_m, std::abs(p.z() - *dem->height(p.x(), p.y())));
  }
  EXPECT_LT(worst_m, 0.3);
  EXPECT_GE(with_rocks.cells.size() + 2, clean.cells.size());  // at most a border cell or two are lost with their rocks
}

TEST(TerrainPatch, ItsCellsFallAnywhereInTheDemsCells) {
  const auto dem = rough();
  const TerrainPatch patch = patch_of(*dem, landmarks(*dem, 3000));
  int central = 0;
  for (const PatchCell& cell : patch.cells) {
    const double phase = std::remainder((kMiddle * cell.p_body).x() - 2.5, 5.0);  // from the centre of a DEM cell
    central += std::abs(phase) < 1.25;
  }
  EXPECT_NEAR(central, 0.5 * static_cast<double>(patch.cells.size()), 0.2 * static_cast<double>(patch.cells.size()));
}

TEST(TerrainPatch, TooLittleGroundOrNoDemGivesNone) {
  const auto dem = rough();
  const auto few = landmarks(*dem, 6), enough = landmarks(*dem, 400);
  EXPECT_FALSE(build_patch({{kMiddle, &few}}, 0, kMiddle, *dem, {}));
  const Pose away(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1e4, 0.0, 0.0));
  EXPECT_FALSE(build_patch({{away, &enough}}, 0, away, *dem, {}));
}

TEST(TerrainPatchFactor, IsSmallAtTruthAndGrowsWithEveryDisplacement) {
  const auto dem = rough();
  const auto factor = factor_of(patch_of(*dem, landmarks(*dem, 800)), dem);
  const double at_truth = factor.evaluateError(to_gtsam(kMiddle)).norm();
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(0, -3, 0), Eigen::Vector3d(0, 0, 1)}) {
    const Pose moved(kMiddle.rotation(), kMiddle.translation() + shift);
    EXPECT_GT(factor.evaluateError(to_gtsam(moved)).norm(), 3.0 * at_truth);
  }
}

TEST(TerrainPatchFactor, HasItsNumericJacobian) {
  const auto dem = rough();
  const auto factor = factor_of(patch_of(*dem, landmarks(*dem, 300)), dem);
  Random random(3);
  for (int i = 0; i < 5; ++i) {
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = (k < 3 ? 0.1 : 4.0) * random.normal();
    const gtsam::Pose3 at = to_gtsam(kMiddle * Pose::exp(xi));
    gtsam::Matrix H;
    factor.evaluateError(at, H);
    const std::function<gtsam::Vector(const gtsam::Pose3&)> error = [&](const gtsam::Pose3& T) {
      return factor.evaluateError(T);
    };
    EXPECT_LT((H - gtsam::numericalDerivative11<gtsam::Vector, gtsam::Pose3, 6>(error, at, 1e-6)).norm(), 1e-4);
  }
}

/// Information about the pose's z in the factor, 1/m^2.
double height_information(const TerrainPatch& patch, const std::shared_ptr<const Dem>& dem) {
  gtsam::Matrix H;
  factor_of(patch, dem).evaluateError(to_gtsam(kMiddle), H);
  return H.rightCols<3>().rowwise().norm().squaredNorm();
}

TEST(TerrainPatchFactor, AThousandPointsOnTheSameGroundAreNotAThousandMeasurements) {
  const auto dem = rough();
  const double few = height_information(patch_of(*dem, landmarks(*dem, 300)), dem);
  const double many = height_information(patch_of(*dem, landmarks(*dem, 3000)), dem);
  EXPECT_LT(many, 1.3 * few);
}

TEST(TerrainPatchFactor, WhitensByTheDemsErrorBetweenItsCells) {
  const auto dem = rough();
  const TerrainPatch patch{.cells = {{Eigen::Vector3d(0, 0, 0), 0.01, 5}, {Eigen::Vector3d(5, 0, 0), 0.02, 5}}};
  const DemErrorModel error{.sigma_m = 0.5, .correlation_length_m = 10.0};
  const TerrainPatchFactor factor(patch, dem, error, {.information_scale = 1.0, .soft_sigmas = 1e6});
  const Pose above(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 1.0));
  Eigen::Vector2d r(1.0 - *dem->height(0, 0), 1.0 - *dem->height(5, 0));
  Eigen::Matrix2d covariance;
  const double cross = error.covariance(5.0);
  covariance << 0.26, cross, cross, 0.27;
  EXPECT_NEAR(factor.evaluateError(to_gtsam(above)).squaredNorm(), r.dot(covariance.inverse() * r),
              1e-5 * r.squaredNorm());
}

TEST(ReliefEvidence, IsPositiveOnTrueReliefAndNegativeWhereTheReliefIsTheDemsError) {
  const auto ground = rough();
  EXPECT_GT(relief_evidence(patch_of(*ground, landmarks(*ground, 400)), kMiddle, *ground, {}), 10.0);
  DemRaster level{.rows = 60, .cols = 60, .cell_m = 5.0, .west_m = -150.0, .north_m = 150.0};
  level.heights.assign(3600, 0.0F);
  const Dem plain(level);
  const Dem noisy(perturb(level, {.noise_m = {.rms = 0.5, .correlation_length_m = 10.0, .seed = 4}}));
  EXPECT_LT(relief_evidence(patch_of(plain, landmarks(plain, 400)), kMiddle, noisy, {}), -2.0);
}

TEST(TerrainPatchFactor, WithoutItsGradientMovesNothingSideways) {
  const auto dem = rough();
  const TerrainPatchFactor factor(patch_of(*dem, landmarks(*dem, 300)), dem, {}, {}, TerrainGradient::vertical_only);
  gtsam::Matrix H;
  factor.evaluateError(to_gtsam(Pose(Eigen::Quaterniond::Identity(), kMiddle.translation())), H);
  EXPECT_LT(H.block(0, 3, H.rows(), 2).norm(), 1e-9);
  EXPECT_GT(H.col(5).norm(), 1.0);
}

TEST(TerrainPatchFactor, IsInactiveOffTheDem) {
  const auto dem = rough();
  const auto factor = factor_of(patch_of(*dem, landmarks(*dem, 300)), dem);
  gtsam::Values values;
  values.insert(0, to_gtsam(Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1e4, 0.0, 0.0))));
  EXPECT_FALSE(factor.active(values));
}

}  // namespace
}  // namespace demslam

#include <gtest/gtest.h>

#include <cmath>

#include "demslam/anchoring/global_fix.h"
#include "demslam/anchoring/submap_alignment.h"
#include "demslam/base/random.h"
#include "demslam/dem/perturb.h"

namespace demslam {
namespace {

/// Relief of 30 m correlation length, 400 m square.
std::shared_ptr<const Dem> relief(double rms_m, std::uint64_t seed = 3) {
  DemRaster dem{.rows = 80, .cols = 80, .cell_m = 5.0, .west_m = -200.0, .north_m = 200.0};
  dem.heights.assign(6400, 0.0F);
  return std::make_shared<Dem>(perturb(dem, {.noise_m = {.rms = rms_m, .correlation_length_m = 30.0, .seed = seed}}));
}

const Pose kTruth(rotation_from_rpy(0.03, -0.02, 0.8), Eigen::Vector3d(12.0, -25.0, 1.0));

/// Ground of `ground` within 40 m around kTruth, 0.1 m of noise; the DEM searched may be another one.
TerrainPatch submap_of(const Dem& ground) {
  Random random(8);
  TerrainPatch submap;
  for (int i = 0; i < 80; ++i) {
    const Eigen::Vector2d p(12.0 + random.uniform(-40.0, 40.0), -25.0 + random.uniform(-40.0, 40.0));
    const double z = *ground.height(p.x(), p.y()) + 0.1 * random.normal();
    submap.cells.push_back(
        {.p_body = kTruth.inverse() * Eigen::Vector3d(p.x(), p.y(), z), .variance_m2 = 0.02, .points = 8});
  }
  return submap;
}

Pose displaced(const Eigen::Vector2d& by_m, double turn_rad) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ())) * kTruth.rotation(),
          kTruth.translation() + Eigen::Vector3d(by_m.x(), by_m.y(), 3.0)};
}

TerrainFix search_from(const Pose& start, double sigma_m, const std::shared_ptr<const Dem>& ground,
                       const std::shared_ptr<const Dem>& dem) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return align_submap(submap_of(*ground), start, variance.asDiagonal(), dem, {.sigma_m = 0.3}, {}, {});
}

double off_m(const TerrainFix& fix) { return (fix.T_map_body.translation() - kTruth.translation()).norm(); }

TEST(SubmapAlignment, FindsTheGroundAgainFromFiveTwentyAndFiftyMetresOff) {
  const auto dem = relief(3.0);
  for (const double distance_m : {5.0, 20.0, 50.0}) {
    const TerrainFix fix = search_from(displaced({0.8 * distance_m, -0.6 * distance_m}, 0.04), distance_m, dem, dem);
    EXPECT_EQ(fix.status, FixStatus::accepted) << distance_m << " m: " << to_string(fix.status);
    EXPECT_LT(off_m(fix), 0.5);
    EXPECT_NEAR(yaw_of(fix.T_map_body.rotation()), 0.8, 0.01);
  }
}

TEST(SubmapAlignment, CovarianceIsTheErrorsSize) {
  double chi_square = 0.0;
  const int worlds = 12;
  for (int seed = 0; seed < worlds; ++seed) {
    const auto ground = relief(3.0, 20 + seed);
    const DemRaster noisy =
        perturb(ground->raster(), {.noise_m = {.rms = 0.3, .correlation_length_m = 10.0, .seed = 90U + seed}});
    const TerrainFix fix = search_from(displaced({4.0, 3.0}, 0.01), 5.0, ground, std::make_shared<Dem>(noisy));
    const Eigen::Vector3d error = (fix.T_map_body.inverse() * kTruth).translation();
    chi_square += error.dot(fix.covariance.bottomRightCorner<3, 3>().inverse() * error) / (3.0 * worlds);
  }
  EXPECT_GT(chi_square, 0.2);
  EXPECT_LT(chi_square, 2.0);
}

TEST(SubmapAlignment, AcceptsNothingOnAPlain) {
  const auto plain = relief(0.01);
  EXPECT_FALSE(search_from(displaced({10.0, 0.0}, 0.0), 10.0, plain, plain).accepted());
}

TEST(SubmapAlignment, TakesNoPlaceOnOtherGround) {
  const auto ground = relief(3.0, 5), elsewhere = relief(3.0, 6);
  EXPECT_NE(search_from(displaced({10.0, 0.0}, 0.0), 10.0, ground, elsewhere).status, FixStatus::accepted);
}

TEST(SubmapAlignment, SaysAtTheEdgeWhenThePlaceIsBeyondTheWindow) {
  const auto dem = relief(3.0);
  const TerrainFix fix = search_from(displaced({31.5, 0.0}, 0.0), 1.0, dem, dem);  // the window ends at 30 m
  EXPECT_FALSE(fix.accepted());
}

TEST(SubmapAlignment, ADemNoisierThanSaidIsSearchedOnceMoreAsSuch) {
  const auto ground = relief(6.0);
  const auto noisy = std::make_shared<Dem>(perturb(ground->raster(), {.noise_m = {.rms = 0.9, .seed = 3}}));
  const Pose start = displaced({12.0, -9.0}, 0.02);
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(100.0);
  SubmapOptions as_said;
  as_said.acceptance.max_noise_scale = 1.0;
  const auto found = [&](const SubmapOptions& options) {
    return align_submap(submap_of(*ground), start, variance.asDiagonal(), noisy, {.sigma_m = 0.3}, {}, options);
  };
  EXPECT_EQ(found(as_said).status, FixStatus::misfit);
  const TerrainFix fix = found({});
  EXPECT_EQ(fix.status, FixStatus::accepted) << to_string(fix.status);
  EXPECT_GE(fix.noise_scale, 2.0);
  EXPECT_LT(off_m(fix), 2.0);
}

TEST(SubmapAlignment, TooLittleGroundAndNoDemAreSaidSo) {
  const auto dem = relief(3.0);
  TerrainPatch few = submap_of(*dem);
  few.cells.resize(10);
  EXPECT_EQ(align_submap(few, kTruth, Matrix6d::Identity(), dem, {}, {}, {}).status, FixStatus::too_little_ground);
  const Pose away(kTruth.rotation(), Eigen::Vector3d(5000.0, 0.0, 0.0));
  EXPECT_EQ(align_submap(submap_of(*dem), away, Matrix6d::Identity(), dem, {}, {}, {}).status, FixStatus::off_the_dem);
}

TEST(GlobalFix, FindsPlaceAndHeadingWithoutAStart) {
  const auto dem = relief(3.0);
  const Pose level(rotation_from_rpy(0.03, -0.02, -2.0), Eigen::Vector3d::Zero());  // heading unknown
  const TerrainFix fix =
      global_fix(submap_of(*dem), level, dem, {.sigma_m = 0.3}, {}, {.centre_m = {40.0, 20.0}, .radius_m = 80.0});
  EXPECT_EQ(fix.status, FixStatus::accepted) << to_string(fix.status);
  EXPECT_LT(off_m(fix), 0.5);
  EXPECT_NEAR(yaw_of(fix.T_map_body.rotation()), 0.8, 0.01);
}

TEST(GlobalFix, GivesNoFixOnOtherGround) {
  const auto ground = relief(3.0, 5), elsewhere = relief(3.0, 6);
  const TerrainFix fix = global_fix(submap_of(*ground), kTruth, elsewhere, {.sigma_m = 0.3}, {}, {.radius_m = 60.0});
  EXPECT_FALSE(fix.accepted());
}

}  // namespace
}  // namespace demslam

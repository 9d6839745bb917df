#include <gtest/gtest.h>

#include <cmath>

#include "demslam/anchoring/observability.h"
#include "demslam/anchoring/start_search.h"
#include "demslam/experiment/estimator.h"
#include "demslam/experiment/fix_experiment.h"

namespace demslam {
namespace {

/// A map that shows the relief well, and (seed 6) ground that has some: what is tested is the search. How often the
/// ground has enough of it is for `demslam experiment fixes` to say.
const OrbitalDem kGoodDem{.noise_rms_m = 0.2};

TEST(SubmapRecovery, BringsARoverBackThatBelievesToStartTwentyMetresAway) {
  const Traverse traverse =
      make_traverse({.length_m = 200.0, .dem = kGoodDem, .start_error_m = 20.0, .start_error_deg = 2.0, .seed = 6});
  EXPECT_GT(estimate(traverse, odometry_only()).horizontal_m, 10.0);
  Estimator hasty = everything();
  hasty.anchoring.vague_start_m = 0.0;
  const EstimateScore found = estimate(traverse, hasty);
  EXPECT_GE(found.anchoring.submaps.moved, 1);
  EXPECT_LT(found.horizontal_m, 2.0);
}

TEST(SubmapRecovery, LeavesAGoodEstimateAlone) {
  const Traverse traverse = make_traverse({.length_m = 200.0, .seed = 4});
  const EstimateScore score = estimate(traverse, everything());
  EXPECT_GE(score.anchoring.submaps.searched, 2);
  EXPECT_EQ(score.anchoring.submaps.moved, 0);
}

TEST(DemShift, IsToldFromAKnownStartAndNoLongerBendsTheDrive) {
  OrbitalDem displaced;
  displaced.bias_m = 1.0;
  displaced.shift_m = {1.5, -1.0};
  const Traverse traverse = make_traverse({.length_m = 378.0, .dem = displaced, .seed = 2});
  const EstimateScore doubted = estimate(traverse, shipped()), trusted = estimate(traverse, trusting_the_dem());
  ASSERT_TRUE(doubted.dem_shift);
  EXPECT_FALSE(trusted.dem_shift);
  const Eigen::Vector3d error = doubted.dem_shift->metres - Eigen::Vector3d(1.5, -1.0, 1.0);
  EXPECT_LT(error.dot(doubted.dem_shift->covariance.ldlt().solve(error)), 16.3);  // chi-square of 3, 99.9 %
  EXPECT_LT(doubted.dem_shift->sigma_m().maxCoeff(), 0.8);                        // of the prior's 1 m
  EXPECT_LT(doubted.ate_m, 0.7 * trusted.ate_m);
  EXPECT_LT(doubted.nees, 0.2 * trusted.nees);
}

TEST(DemNoise, NobodyToldNoLongerBendsTheDrive) {
  const Traverse traverse = make_traverse({.length_m = 600.0, .dem = {.noise_rms_m = 2.0}, .seed = 2});
  Estimator told = shipped();
  told.anchoring.estimate_noise = false;
  const EstimateScore warned = estimate(traverse, shipped()), lied_to = estimate(traverse, told);
  EXPECT_GT(warned.anchoring.noise_scale, 2.0);
  EXPECT_EQ(lied_to.anchoring.noise_scale, 1.0);
  EXPECT_LT(warned.ate_m, 0.7 * lied_to.ate_m);
  EXPECT_LT(warned.nees, 0.2 * lied_to.nees);
}

TEST(FixExperiment, CountsNoWrongFixOnHighlandAndMare) {
  const auto rows = fix_experiment({.reliefs = {Relief::highland, Relief::mare},
                                    .traverse = {.length_m = 300.0, .dem = kGoodDem},
                                    .start_errors_m = {20.0},
                                    .seeds = 2});
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_GT(rows[0].accepted, 0);
  for (const FixRow& row : rows) EXPECT_EQ(row.wrong, 0) << row.relief;
}

/// Odometry alone, in a frame of its own.
PoseGraph unplaced(const Traverse& traverse) {
  PoseGraph graph;
  graph.add_keyframe(Pose());
  graph.add_prior(0, Pose(), Matrix6d::Identity());
  for (const RelativePose& motion : traverse.odometry) {
    graph.add_keyframe(graph.T_map_body(motion.i) * motion.T_i_j);
    graph.add_odometry(motion);
  }
  return graph;
}

/// Searches of 100 m and 120 m of ground; a heading keeps the test quick.
std::optional<Pose> way_into_the_map(const Traverse& traverse, const PoseGraph& graph, std::shared_ptr<const Dem> dem,
                                     const Eigen::Vector2d& centre, std::optional<double> heading_rad) {
  const StartSearchOptions options{
      .fix = {.centre_m = centre, .radius_m = 30.0, .heading_rad = heading_rad, .sigma_tilt_deg = 8.0},
      .length_m = 120.0,
      .first_m = 100.0};
  StartSearch search(std::move(dem), {}, {}, {}, options, traverse.T_body_left);
  for (std::size_t k = 0; k < graph.size(); ++k) {
    search.add(traverse.landmarks[k]);
    if (const auto T = search.advance(graph, k, k == 0 ? 0.0 : 2.0)) return T;
  }
  return std::nullopt;
}

TEST(StartSearch, FindsWhereADriveWithoutAStartTookPlace) {
  const Traverse traverse = make_traverse({.length_m = 122.0, .dem = kGoodDem, .seed = 6});
  const PoseGraph graph = unplaced(traverse);
  const Eigen::Vector2d near = traverse.T_map_body[0].translation().head<2>() + Eigen::Vector2d(15.0, -20.0);
  const auto T_map_own = way_into_the_map(traverse, graph, std::make_shared<Dem>(traverse.dem), near, std::nullopt);
  ASSERT_TRUE(T_map_own.has_value());
  const Eigen::Vector3d found = (*T_map_own * graph.T_map_body(20)).translation();
  EXPECT_LT((found - traverse.T_map_body[20].translation()).head<2>().norm(), 4.0);
}

TEST(StartSearch, SaysNothingOnTheDemOfAnotherPlace) {
  const Traverse traverse = make_traverse({.length_m = 120.0, .seed = 9}),
                 other = make_traverse({.length_m = 120.0, .seed = 10});
  EXPECT_FALSE(way_into_the_map(traverse, unplaced(traverse), std::make_shared<Dem>(other.dem), {-40.0, 0.0}, 0.0));
}

TEST(VagueStart, IsLookedForBeforeAnythingIsTiedToTheDem) {
  const Traverse traverse =
      make_traverse({.length_m = 200.0, .dem = kGoodDem, .start_error_m = 40.0, .start_error_deg = 2.0, .seed = 6});
  Estimator hasty = shipped();
  hasty.anchoring.vague_start_m = 0.0;
  EXPECT_GT(estimate(traverse, hasty).horizontal_m, 5.0);
  const EstimateScore found = estimate(traverse, shipped());
  EXPECT_EQ(found.anchoring.start_search, "found");
  EXPECT_GT(found.anchoring.patches, 5);  // the ground behind the rover is tied, too
  EXPECT_LT(found.horizontal_m, 2.0);
  EXPECT_LT(found.nees, 5.0);
}

TEST(VagueStart, ThatIsNotFoundLeavesTheOdometryAndItsDoubt) {
  Traverse traverse = make_traverse({.length_m = 200.0, .start_error_m = 40.0, .start_error_deg = 2.0, .seed = 9});
  traverse.dem = make_traverse({.length_m = 200.0, .seed = 10}).dem;  // of another place
  const EstimateScore lost = estimate(traverse, shipped());
  EXPECT_TRUE(lost.anchoring.start_search.starts_with("no fix: ")) << lost.anchoring.start_search;
  EXPECT_EQ(lost.anchoring.height + lost.anchoring.patches, 0);
  EXPECT_NEAR(lost.ate_m, estimate(traverse, odometry_only()).ate_m, 0.1);
  EXPECT_LT(lost.nees, 5.0);
}

TEST(VagueStart, IsOneThatMayBeOffByMoreThanTheOptionSays) {
  Matrix6d covariance = Matrix6d::Identity();
  EXPECT_FALSE(search_for_vague_start(Pose(), covariance, 10.0));
  covariance(4, 4) = 400.0;
  EXPECT_TRUE(search_for_vague_start(Pose(), covariance, 10.0));
  EXPECT_FALSE(search_for_vague_start(Pose(), covariance, 0.0));
}

TEST(Observability, PredictsTheSizeOfTheErrorsWithinAFactorOfThree) {
  double measured2 = 0.0, predicted2 = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Traverse traverse = make_traverse({.length_m = 300.0, .seed = seed});
    std::vector<Eigen::Vector2d> route;
    for (const Pose& T : traverse.T_map_body) route.push_back(T.translation().head<2>());
    ObservabilityOptions options{.start_sigma_m = 0.01, .start_sigma_deg = 0.01};
    options.anchoring = filtered_patches().anchoring;
    const auto predicted = predict_along(route, std::make_shared<Dem>(traverse.dem), options);
    for (const PredictedPose& p : predicted)
      predicted2 += std::pow(p.horizontal_after_m, 2) / (4.0 * static_cast<double>(predicted.size()));
    measured2 += std::pow(estimate(traverse, filtered_patches()).horizontal_m, 2) / 4.0;
  }
  EXPECT_GT(std::sqrt(predicted2), std::sqrt(measured2) / 3.0);
  EXPECT_LT(std::sqrt(predicted2), std::sqrt(measured2) * 3.0);
}

TEST(Observability, WithoutReliefIsAsVagueAsTheOdometryAndReliefMakesItSure) {
  DemRaster plain{.rows = 60, .cols = 60, .cell_m = 5.0, .west_m = -150.0, .north_m = 150.0};
  plain.heights.assign(3600, 0.0F);
  DemRaster waves = plain;
  for (int row = 0; row < 60; ++row) {
    for (int col = 0; col < 60; ++col) {
      const Eigen::Vector2d p = plain.centre(row, col);
      waves.at(row, col) = static_cast<float>(4.0 * std::sin(0.1 * p.x()) * std::cos(0.12 * p.y()));
    }
  }
  const std::vector<Eigen::Vector2d> route = {{-100.0, 0.0}, {100.0, 20.0}};
  const ObservabilityOptions options{.systematic = OdometryErrors().as_states()};
  const auto on_plain = predict_along(route, std::make_shared<Dem>(plain), options).back();
  const auto on_waves = predict_along(route, std::make_shared<Dem>(waves), options).back();
  EXPECT_GT(on_plain.horizontal_m, 0.95 * on_plain.odometry_horizontal_m);
  EXPECT_LT(on_waves.horizontal_m, 0.5 * on_waves.odometry_horizontal_m);
  EXPECT_LT(predicted_sigma(Dem(waves), options).at(15, 15), 1.0F);
  EXPECT_GT(predicted_sigma(Dem(plain), options).at(15, 15), 100.0F);
}

/// The sun leaves the turn about itself free; the ground's height and slope hold that.
TEST(Sun, BoundsTheHeadingWhereTheGroundIsFlat) {
  const OdometryErrors turning{.rotation_deg_per_sqrt_m = 0.05, .scale_sigma = 0.0, .rotation_bias_deg_per_m = 0.01};
  const Traverse traverse = make_traverse({.relief = Relief::flat, .length_m = 378.0, .odometry = turning, .seed = 2});
  const double ground_m = estimate(traverse, filtered_patches()).horizontal_m;
  EXPECT_LT(estimate(traverse, with_sun(filtered_patches())).horizontal_m, 0.5 * ground_m);
}

}  // namespace
}  // namespace demslam

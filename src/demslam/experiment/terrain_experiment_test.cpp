#include "demslam/experiment/terrain_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stop_token>

namespace demslam {
namespace {

TerrainExperiment small_experiment() {
  return {.scenes = {{"small", {.length_m = 60.0}}}, .estimators = {odometry_only(), published_factors()}, .seeds = 5};
}

TEST(Estimators, TheMoreOfTheTerrainTheyUseTheBetterTheyKnowWhereTheyAre) {
  const Traverse traverse = make_traverse({.length_m = 378.0, .odometry = OdometryErrors{}.times(3.0), .seed = 3});
  const double odometry_m = estimate(traverse, odometry_only()).ate_m;
  EXPECT_LT(estimate(traverse, terrain_patches()).ate_m, 0.3 * odometry_m);
  EXPECT_LT(estimate(traverse, shipped()).ate_m, 0.3 * odometry_m);
}

TEST(Traverse, IsTheSameForTheSameSeedOnly) {
  const TraverseOptions options{.length_m = 60.0, .seed = 5};
  const Traverse a = make_traverse(options), b = make_traverse(options);
  EXPECT_EQ(a.dem.heights, b.dem.heights);
  EXPECT_EQ(a.odometry.back().T_i_j.translation(), b.odometry.back().T_i_j.translation());
  EXPECT_EQ(a.landmarks.back().points.back().p_left, b.landmarks.back().points.back().p_left);
  EXPECT_NE(a.dem.heights, make_traverse({.length_m = 60.0, .seed = 6}).dem.heights);
}

TEST(Traverse, HasTheLengthAskedForAndALoopEndsWhereItBegan) {
  const Traverse lanes = make_traverse({.length_m = 300.0});
  EXPECT_EQ(lanes.T_map_body.size(), 151U);
  const Traverse loop = make_traverse({.length_m = 200.0, .loop = true});
  const Eigen::Vector3d start = loop.T_map_body[0].translation();
  EXPECT_LT((loop.T_map_body[100].translation() - start).head<2>().norm(), 2.0);
}

TEST(Traverse, PerfectSensorsSeeTheTruth) {
  TraverseOptions options{.length_m = 60.0, .odometry = OdometryErrors{}.times(1e-9)};
  const Traverse traverse = make_traverse(options);
  Pose T_map_body = traverse.T_map_body.front();
  for (const RelativePose& motion : traverse.odometry) T_map_body = T_map_body * motion.T_i_j;
  EXPECT_LT((T_map_body.translation() - traverse.T_map_body.back().translation()).norm(), 1e-6);
}

TEST(TerrainExperiment, GivesOneRowPerEstimatorOverTheSeedsDoneWhenStopped) {
  std::stop_source stop;
  const Progress progress{[&](std::size_t, std::size_t) { stop.request_stop(); }, stop.get_token()};
  TerrainExperiment experiment = small_experiment();
  experiment.threads = 1;
  experiment.estimators = {odometry_only()};
  const auto rows = terrain_experiment(experiment, nullptr, progress);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].seeds, 1);
  EXPECT_EQ(rows[0].median_ate_m, rows[0].worst_ate_m);
}

TEST(TerrainExperiment, HasTheSameFiguresWhateverTheNumberOfThreadsAndWhenItGoesOn) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "terrain_experiment";
  std::filesystem::remove_all(folder);
  const SeedStore store(folder);
  TerrainExperiment experiment = small_experiment();
  experiment.seeds = 1;
  terrain_experiment(experiment, &store);
  experiment.seeds = 3;
  const std::string resumed = experiment_json(terrain_experiment(experiment, &store));
  experiment.threads = 1;
  EXPECT_EQ(resumed, experiment_json(terrain_experiment(experiment)));
  EXPECT_EQ(resumed, experiment_json(terrain_experiment(experiment, &store)));
}

TEST(TerrainExperiment, FinishedSeedsAreNotDrivenAgain) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "terrain_experiment_kept";
  std::filesystem::remove_all(folder);
  const SeedStore store(folder);
  TerrainScene scene = small_experiment().scenes.front();
  store.save(scene, {{"odometry", {.ate_m = 42.0}}});
  EXPECT_EQ(store.load(scene).at("odometry").ate_m, 42.0);
  scene.traverse.dem.bias_m = 1.0;
  EXPECT_TRUE(store.load(scene).empty());  // another traverse
}

TEST(TerrainExperiment, MarkdownBeginsWithAColumnPerScene) {
  const std::vector<ExperimentRow> rows = {{.scene = "a", .estimator = "x", .median_ate_m = 1.0},
                                           {.scene = "b", .estimator = "x", .median_ate_m = 2.0}};
  EXPECT_THAT(experiment_markdown(rows),
              testing::HasSubstr("| estimator | a | b |\n| --- | --- | --- |\n| x | 1.00 | 2.00 |"));
}

}  // namespace
}  // namespace demslam

#include "demslam/experiment/frontend_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

namespace demslam {
namespace {

FrontendExperiment small_experiment() {
  FrontendExperiment experiment;
  experiment.frontends = {{"classical", {.max_features = 300}}, {"lunar", {.extractor = "lunar", .max_features = 300}}};
  experiment.simulated = {
      .reliefs = {Relief::highland}, .seeds = 1, .size_px = 256, .spacings_m = {0.5}, .sun_turns_deg = {180.0}};
  return experiment;
}

TEST(FrontendExperiment, HasARowForEveryFrontendOnEveryGroupOfPairs) {
  const std::vector<FrontendRow> rows = frontend_experiment(small_experiment());
  std::vector<std::string> names;
  for (const FrontendRow& row : rows) names.push_back(row.group + " " + row.frontend);
  EXPECT_THAT(names, testing::ElementsAre("drive 0.5 m classical", "drive 0.5 m lunar", "sun 180 deg classical",
                                          "sun 180 deg lunar"));
  EXPECT_EQ(frontend_table(rows).rows.size(), 4U);
}

TEST(FrontendExperiment, TheClassicalFrontendFindsAShortDriveAndTheTruthAgrees) {
  FrontendExperiment experiment = small_experiment();
  experiment.frontends.resize(1);
  experiment.simulated.sun_turns_deg = {};
  const std::vector<FrontendRow> rows = frontend_experiment(experiment);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_GT(rows[0].right, 30.0);
  EXPECT_GT(rows[0].precision, 70.0);
  EXPECT_EQ(rows[0].recall, 100.0);
  EXPECT_EQ(rows[0].wrong + rows[0].failed, 0);
}

TEST(FrontendExperiment, AModelOfOnesOwnHasRowsOfItsOwn) {
  const std::filesystem::path weights = std::filesystem::path(DEMSLAM_SOURCE_DIR) / "src/demslam/features/weights";
  const auto all = compared_frontends(
      300, {{.name = "mine", .extractor = weights / "lunar.onnx", .matcher = weights / "lunar_matcher.onnx"}});
  FrontendExperiment experiment = small_experiment();
  experiment.frontends = {all[0], all[6]};
  const std::vector<FrontendRow> rows = frontend_experiment(experiment);
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[1].frontend, "mine + its matcher");
  for (const std::size_t group : {0, 2}) {  // the file and its card are what is built in
    EXPECT_EQ(rows[group].right, rows[group + 1].right) << rows[group].group;
    EXPECT_EQ(rows[group].matches, rows[group + 1].matches) << rows[group].group;
    EXPECT_GT(rows[group].right, 10.0) << rows[group].group;
  }
}

TEST(FrontendExperiment, SaysHowSureItsMeansAre) {
  FrontendExperiment experiment = small_experiment();
  experiment.frontends.resize(1);
  experiment.simulated.sun_turns_deg = {};
  EXPECT_EQ(frontend_experiment(experiment)[0].right_95, 0.0);  // of one pair nobody can say
  experiment.simulated.seeds = 2;
  const double right_95 = frontend_experiment(experiment)[0].right_95;
  experiment.simulated.seeds = 1;
  const double first = frontend_experiment(experiment)[0].right;
  experiment.simulated.first_seed += 1;
  const double second = frontend_experiment(experiment)[0].right;
  EXPECT_NEAR(right_95, 1.96 * std::abs(first - second) / 2.0, 1e-9);
}

TEST(FrontendExperiment, JudgesRealPairsByTheTruthOfTheirSequence) {
  const std::filesystem::path data = std::filesystem::path(DEMSLAM_SHARED_DIR) / "data";
  if (!std::filesystem::exists(data / "kitti_seq1")) GTEST_SKIP() << "no kitti_seq1 in " << data;
  std::vector<ViewPair> pairs;
  real_pairs(data, std::filesystem::path(DEMSLAM_SOURCE_DIR) / "configs/rover_sandbox.toml", 2,
             [&](const ViewPair& pair) {
               if (pair.group == "kitti_seq1") pairs.push_back(pair);
               return pairs.size() < 2;
             });
  ASSERT_EQ(pairs.size(), 2U);
  ASSERT_TRUE(pairs[0].T_a_b.has_value());
  EXPECT_GT(pairs[0].T_a_b->translation().z(), 0.5);  // the car drives along the camera's axis
  EXPECT_LT(pairs[0].T_a_b->translation().head<2>().norm(), 0.2);
}

TEST(AreaUnderRecall, IsOneForNoErrorAndCountsFailuresAsNothing) {
  const double failed = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(area_under_recall({0.0, 0.0}, 5.0), 100.0);
  EXPECT_DOUBLE_EQ(area_under_recall({2.5, failed}, 5.0), 25.0);
  EXPECT_DOUBLE_EQ(area_under_recall({}, 5.0), 0.0);
}

}  // namespace
}  // namespace demslam

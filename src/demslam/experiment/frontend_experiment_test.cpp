#include "demslam/experiment/frontend_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

#include "demslam/experiment/loops_experiment.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace demslam {
namespace {

TEST(LoopsExperiment, FalseLoopsLeaveTheEstimateAsItIsAndTrueOnesInIt) {
  const auto runs = loops_experiment({.lap_m = 100.0, .laps = 3, .seeds = 1, .false_loops = 150});
  ASSERT_EQ(runs.size(), 2U);
  for (const LoopsRun& run : runs) {
    EXPECT_GT(run.injected, 70);
    EXPECT_GT(run.plausible, 10);
    EXPECT_GT(run.true_left, 20);
    EXPECT_GE(run.true_left, 0.95 * run.true_accepted);
    EXPECT_LT(run.apart_m, 0.1);
    EXPECT_LT(run.ate_m - run.ate_clean_m, 0.1);
  }
}

TEST(LoopsExperiment, DoesNotRepeatWhatIsFinished) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "loops_experiment";
  const FinishedRuns finished(folder);
  LoopsExperiment experiment{
      .lap_m = 100.0, .step_m = 2.0, .laps = 2, .seeds = 1, .false_loops = 0, .anchored = {false}};
  const auto first = loops_experiment(experiment, &finished);
  const auto written = std::filesystem::last_write_time(folder / "runs" / "odometry_1.json");
  const auto again = loops_experiment(experiment, &finished);
  EXPECT_EQ(loops_json(first), loops_json(again));
  EXPECT_EQ(std::filesystem::last_write_time(folder / "runs" / "odometry_1.json"), written);
  experiment.false_loops = 10;
  EXPECT_GT(loops_experiment(experiment, &finished).front().injected, 0);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace demslam

#include "demslam/experiment/loops_experiment.h"

#include <gtest/gtest.h>

namespace demslam {
namespace {

TEST(LoopsExperiment, FalseLoopsLeaveTheEstimateAsItIs) {
  const auto runs = loops_experiment({.lap_m = 150.0, .laps = 3, .seeds = 1, .false_loops = 150});
  ASSERT_EQ(runs.size(), 2U);
  for (const LoopsRun& run : runs) {
    EXPECT_GT(run.injected, 100);
    EXPECT_GT(run.plausible, 10);
    EXPECT_GT(run.true_left, 20);
    EXPECT_EQ(run.false_left, 0);
    EXPECT_LT(run.ate_m - run.ate_clean_m, 0.1);
  }
}

}  // namespace
}  // namespace demslam

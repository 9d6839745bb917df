#include "demslam/experiment/scale_experiment.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

namespace demslam {
namespace {

TEST(PetalRoute, LeadsThroughHomeInTheSameDirectionAgainAndAgain) {
  const PetalRoute route(3000.0, 1000.0);
  int homes = 0;
  bool away = false;
  for (double s = 0.0; s < 3000.0; s += 0.5) {
    const Eigen::Vector3d p = route.at(s);
    EXPECT_LT(p.head<2>().cwiseAbs().maxCoeff(), 900.0);
    if (p.head<2>().norm() > 20.0) away = true;
    if (!away || p.head<2>().norm() > 0.5) continue;
    ++homes;
    away = false;
    EXPECT_NEAR(std::remainder(p.z(), 2.0 * std::numbers::pi), 0.0, 0.02);
  }
  EXPECT_GE(homes, 2);
}

TEST(ScaleExperiment, MeasuresAShortDriveWithItsMap) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "scale_experiment";
  ScaleExperiment experiment{.lengths_km = {0.3}, .map_folder = folder};
  experiment.drive.world_m = 1000.0;
  const auto rows = scale_experiment(experiment);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].keyframes, 601U);
  const auto in_the_window = static_cast<std::size_t>(PoseGraphOptions{}.window_m / experiment.drive.step_m);
  const auto held_by_loops = 2 * static_cast<std::size_t>(rows[0].loops_accepted);
  EXPECT_LT(rows[0].variables, in_the_window + held_by_loops + 50U);  // 50: terrain patches, systematic states
  EXPECT_LT(rows[0].ate_final_m, 1.0);
  EXPECT_GT(rows[0].loops_accepted, 0);
  EXPECT_GT(rows[0].map_mb_per_km, 10.0);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

}  // namespace
}  // namespace demslam

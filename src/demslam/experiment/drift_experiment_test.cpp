#include "demslam/experiment/drift_experiment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace demslam {
namespace {

std::filesystem::path empty_folder(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  return folder;
}

/// `length_m` with small images.
SceneOptions short_drive(double length_m, double spacing_m, int size_px) {
  SceneOptions scene;
  scene.terrain.size_m = 200.0;
  scene.camera.width_px = scene.camera.height_px = size_px;
  scene.rover.length_m = length_m;
  scene.rover.space_frames(spacing_m);
  scene.output = {.depth = false};
  return scene;
}

TEST(DriftExperiment, RunsEveryFrontendAndMethodOnceAndGoesOn) {
  const std::filesystem::path out = empty_folder("drift");
  const DriftExperiment experiment{.frontends = {{"classical", {}}, {"SIFT", {.extractor = "sift"}}},
                                   .drives = {{"hills", short_drive(24.0, 0.6, 256)}}};
  const std::vector<DriftRow> rows = drift_experiment(experiment, out);
  ASSERT_EQ(rows.size(), 6U);
  for (const DriftRow& row : rows) {
    EXPECT_EQ(row.completion, 1.0) << row.frontend;
    EXPECT_NEAR(row.path_m, 24.0, 1.0) << row.frontend;
    EXPECT_LT(row.translation_percent, 3.0) << row.frontend << to_string(row.method);
    EXPECT_GT(row.cpu_ms, 0.0);
  }
  EXPECT_GT(rows[0].translation_percent, rows[1].translation_percent);  // frame to frame, and from the keyframe
  EXPECT_NE(rows[1].translation_percent, rows[2].translation_percent);  // keyframe and window
  EXPECT_NE(rows[0].translation_percent, rows[3].translation_percent);  // front-ends

  const std::vector<DriftRow> again = drift_experiment(experiment, out);
  ASSERT_EQ(again.size(), 6U);
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(again[i].cpu_ms, rows[i].cpu_ms);  // not run again
}

TEST(DriftExperiment, ADriveThatIsSoonLostIsARowWithoutDrift) {
  const std::filesystem::path out = empty_folder("drift_lost");
  SceneOptions scene = short_drive(12.0, 1.0, 128);
  scene.camera.exposure = 1e-3;  // dark: nothing is ever seen
  const DriftExperiment experiment{
      .frontends = {{"classical", {}}}, .methods = {OdometryMethod::pnp}, .drives = {{"dark", scene}}};
  for (int call = 0; call < 2; ++call) {  // run, and read back
    const std::vector<DriftRow> rows = drift_experiment(experiment, out);
    ASSERT_EQ(rows.size(), 1U);
    EXPECT_LT(rows.front().completion, 0.2);
    EXPECT_TRUE(std::isnan(rows.front().translation_percent));
    EXPECT_FALSE(drift_table(rows).rows.empty());
  }
}

}  // namespace
}  // namespace demslam

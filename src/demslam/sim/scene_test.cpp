#include "demslam/sim/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

std::filesystem::path written(const std::string& text) {
  const auto file = std::filesystem::path(testing::TempDir()) / "scene_test.toml";
  std::ofstream(file) << text;
  return file;
}

std::string error_of(const std::string& text) {
  try {
    read_scene(written(text));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Scene, DefaultsNeedNoFile) { EXPECT_NO_THROW(check_scene(SceneOptions{}, "scene")); }

TEST(Scene, EffectiveSceneReadsBackToTheSameText) {
  SceneOptions scene;
  scene.seed = 77;
  scene.terrain.relief = Relief::mare;
  scene.rover.route = RouteKind::waypoints;
  scene.rover.waypoints_m = {{0.0, 0.5}, {10.25, -3.0}};
  scene.light.sun_elevation_deg = 1.0 / 3.0;
  EXPECT_EQ(scene_toml(read_scene(written(scene_toml(scene)))), scene_toml(scene));
}

TEST(Scene, FileChangesSingleValues) {
  const SceneOptions scene = read_scene(written("[light]\nphotometry = \"lunar_lambert\"\n"));
  EXPECT_EQ(scene.light.photometry, Photometry::lunar_lambert);
  EXPECT_EQ(scene.camera.width_px, 1024);
}

TEST(Scene, DemIsFoundBesideTheFile) {
  const SceneOptions scene = read_scene(written("[terrain]\ndem = \"moon.tif\"\n"));
  EXPECT_EQ(scene.terrain.dem, std::filesystem::path(testing::TempDir()) / "moon.tif");
}

TEST(Scene, TypoIsRefusedWithItsLineAndTheNearestName) {
  EXPECT_THAT(error_of("[camera]\nwidth_px = 64\nbaselin_m = 0.2\n"),
              testing::AllOf(testing::HasSubstr("scene_test.toml:3"), testing::HasSubstr("baseline_m")));
}

TEST(Scene, SunBelowTheHorizonIsRefusedWithItsLine) {
  EXPECT_THAT(error_of("[light]\nsun_elevation_deg = -3\n"),
              testing::AllOf(testing::HasSubstr("scene_test.toml:2"), testing::HasSubstr("below the horizon")));
}

TEST(Scene, ValueOutOfRangeIsRefusedWithItsLine) {
  EXPECT_THAT(error_of("seed = 3\n[camera]\nbaseline_m = 0\n"), testing::HasSubstr("scene_test.toml:3"));
}

TEST(Scene, UnknownWordIsRefusedWithTheKnownOnes) {
  EXPECT_THAT(error_of("[terrain]\nrelief = \"alps\"\n"), testing::HasSubstr("\"highland\""));
}

TEST(Scene, WaypointRouteNeedsTwoPoints) {
  EXPECT_THAT(error_of("[rover]\nroute = \"waypoints\"\nwaypoints_m = [[0, 0]]\n"), testing::HasSubstr("two points"));
}

TEST(Presets, AllAreValidScenes) {
  int presets = 0;
  for (const auto& entry : std::filesystem::directory_iterator(DEMSLAM_SOURCE_DIR "/configs")) {
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    if (text.str().find("[terrain]") == std::string::npos) continue;  // a calibration or other settings
    EXPECT_NO_THROW(read_scene(entry.path())) << entry.path();
    ++presets;
  }
  EXPECT_GE(presets, 3);
}

}  // namespace
}  // namespace demslam

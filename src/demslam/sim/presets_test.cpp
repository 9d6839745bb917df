#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "demslam/sim/planner.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/scene.h"

namespace demslam {
namespace {

SceneOptions preset(const std::string& name) {
  return read_scene(std::filesystem::path(DEMSLAM_SOURCE_DIR) / "configs" / (name + ".toml"));
}

/// The steepest stand of the rover along a route, degrees, looked at each two metres.
double steepest_deg(const Terrain& terrain, const RoverOptions& rover, const Route& route) {
  double lowest_up = 1.0;
  for (double s = 0.0; s <= route.length_m(); s += 2.0) {
    const Pose pose = standing_pose(terrain, rover, route.position(s), route.heading(s));
    lowest_up = std::min(lowest_up, (pose.rotation() * Eigen::Vector3d::UnitZ()).z());
  }
  return std::acos(lowest_up) * 180.0 / std::numbers::pi;
}

struct Stated {
  std::string name;
  double length_m;
};

class Preset : public testing::TestWithParam<Stated> {};

TEST_P(Preset, DrivesItsStatedLengthOverGentleGround) {
  const SceneOptions scene = preset(GetParam().name);
  const Terrain terrain(scene.terrain, scene.seed);
  const RoverOptions rover = with_known_route(terrain, scene.rover);
  const Route route(rover);
  EXPECT_NEAR(route.length_m(), GetParam().length_m, 0.02 * GetParam().length_m);
  EXPECT_LT(steepest_deg(terrain, rover, route), 25.0);
}

TEST(CraterLoop, EndsInTheRoversOwnTracks) {
  SceneOptions scene = preset("crater_loop_1030m");
  for (scene.seed = 1; scene.seed <= 4; ++scene.seed) {
    const Terrain terrain(scene.terrain, scene.seed);
    RoverOptions rover = with_known_route(terrain, scene.rover);
    const Route route(rover);
    rover.stop_after_m = 80.0;
    const Route first(rover);
    double in_tracks_m = 0.0;
    for (double s = route.length_m() - 60.0; s < route.length_m(); s += 1.0) {
      if (first.distance_m(route.position(s)) < 0.8) in_tracks_m += 1.0;
    }
    EXPECT_GT(in_tracks_m, 20.0) << "world " << scene.seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Long, Preset,
                         testing::Values(Stated{"polar_11km", 11000.0}, Stated{"traverse_1190m", 1190.0},
                                         Stated{"crater_loop_1030m", 1030.0}, Stated{"traverse_378m", 378.0}),
                         [](const auto& preset) { return preset.param.name; });

}  // namespace
}  // namespace demslam

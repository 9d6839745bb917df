#include "demslam/sim/rover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/sim/planner.h"
#include "demslam/sim/rocks.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

std::string error_of(const Terrain& terrain, const RoverOptions& rover) {
  try {
    drive(terrain, rover, Route(rover));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Rover, StandsOnAPlaneWithItsNormalUp) {
  const Eigen::Vector2d slope(0.1, -0.25);
  const Terrain terrain(smooth_ground(), 1, plane_raster(2.0, slope));
  const Pose T_map_body = standing_pose(terrain, RoverOptions{}, {3.0, 4.0}, 0.7);
  EXPECT_NEAR(T_map_body.translation().z(), 2.0 + slope.dot(Eigen::Vector2d(3.0, 4.0)), 1e-5);
  EXPECT_LT((T_map_body.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(-0.1, 0.25, 1.0).normalized()).norm(),
            1e-5);
  EXPECT_NEAR(yaw_of(T_map_body.rotation()), 0.7, 1e-6);
}

TEST(Rover, FramesAreOneStepApartOnTheRoute) {
  RoverOptions rover;
  rover.length_m = 10.0;
  rover.speed_m_per_s = 0.5;
  rover.frame_rate_hz = 2.0;
  const Trajectory trajectory = drive(Terrain(smooth_ground(), 1, plane_raster(0.0, {0.0, 0.0})), rover, Route(rover));
  ASSERT_EQ(trajectory.size(), 41U);
  EXPECT_EQ(trajectory[3].t_ns - trajectory[0].t_ns, 1'500'000'000);
  EXPECT_NEAR(trajectory[4].pose.translation().x(), 1.0, 1e-9);
}

TEST(Rover, SpacedFramesAreTheSameDriveSeenLessOften) {
  RoverOptions rover;
  rover.length_m = 10.0;
  const Terrain terrain(smooth_ground(), 1, plane_raster(0.0, {0.0, 0.0}));
  const Trajectory every = drive(terrain, rover, Route(rover));
  rover.space_frames(2.0);
  const Trajectory fourth = drive(terrain, rover, Route(rover));
  ASSERT_EQ(fourth.size(), 6U);
  for (std::size_t i = 0; i < fourth.size(); ++i) {
    EXPECT_EQ(fourth[i].t_ns, every[4 * i].t_ns);
    EXPECT_LT((fourth[i].pose.inverse() * every[4 * i].pose).log().norm(), 1e-12);
  }
}

TEST(Rover, CamerasAreAHalfBaselineLeftAndRight) {
  const StereoRig rig = stereo_rig(CameraOptions{});
  EXPECT_NEAR(rig.T_body_left.translation().y(), 0.155, 1e-12);
  EXPECT_NEAR((rig.T_body_left * rig.T_left_right).translation().y(), -0.155, 1e-12);
  EXPECT_NEAR(rig.left.fx, 512.0, 1e-9);
  EXPECT_NEAR(rig.left.cx, 511.5, 1e-12);
  const Eigen::Vector3d ahead = rig.T_body_left.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(ahead.z(), -std::sin(20.0 * std::numbers::pi / 180.0), 1e-12);
}

TEST(Rover, LeavingTheTerrainIsRefusedWithThePlace) {
  RoverOptions rover;
  rover.length_m = 50.0;
  const Terrain terrain(smooth_ground(), 1, plane_raster(0.0, {0.0, 0.0}, 60, 1.0));
  EXPECT_THAT(error_of(terrain, rover),
              testing::AllOf(testing::HasSubstr("leaves the terrain"), testing::HasSubstr("x = 30.0")));
}

TEST(Rover, CrossingAHoleIsRefusedWithThePlace) {
  RoverOptions rover;
  rover.length_m = 20.0;
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, 60, 1.0);
  raster.at(30, 40) = std::nanf("");
  EXPECT_THAT(error_of(Terrain(smooth_ground(), 1, raster), rover), testing::HasSubstr("hole"));
}

TEST(Route, LoopEndsWhereItBegan) {
  RoverOptions rover;
  rover.route = RouteKind::loop;
  rover.length_m = 100.0;
  rover.heading_deg = 30.0;
  const Route route(rover);
  EXPECT_NEAR(route.length_m(), 103.0, 0.05);
  EXPECT_LT((route.position(100.0) - route.position(0.0)).norm(), 0.01);
  EXPECT_NEAR(route.heading(0.0), 30.0 * std::numbers::pi / 180.0, 0.02);
}

TEST(Route, PassesItsWaypointsWithoutAKink) {
  RoverOptions rover;
  rover.route = RouteKind::waypoints;
  rover.waypoints_m = {{0.0, 0.0}, {10.0, 0.0}, {20.0, 10.0}, {20.0, 30.0}};
  const Route route(rover);
  for (const Eigen::Vector2d& point : rover.waypoints_m) EXPECT_LT(route.distance_m(point), 1e-6);
  for (double s = 0.5; s < route.length_m(); s += 0.1) {
    EXPECT_LT(std::abs(std::remainder(route.heading(s) - route.heading(s - 0.1), 2.0 * std::numbers::pi)), 0.05) << s;
  }
}

TEST(Planner, GoesAroundASteepHillAndAHole) {
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, 400, 1.0);
  for (int row = 0; row < 400; ++row) {
    for (int col = 0; col < 400; ++col) {
      const double r = (raster.centre(row, col) - Eigen::Vector2d(-60.0, 0.0)).norm();
      raster.at(row, col) = static_cast<float>(30.0 * std::exp(-r * r / 800.0));
      if ((raster.centre(row, col) - Eigen::Vector2d(60.0, 0.0)).norm() < 15.0) raster.at(row, col) = std::nanf("");
    }
  }
  const Terrain terrain(smooth_ground(), 1, raster);
  RoverOptions rover;
  rover.route = RouteKind::planned;
  rover.waypoints_m = {{-150.0, 0.0}, {150.0, 0.0}};
  const Route route(with_known_route(terrain, rover));
  EXPECT_LT((route.position(route.length_m()) - Eigen::Vector2d(150.0, 0.0)).norm(), 5.0);
  EXPECT_GT(route.distance_m({-60.0, 0.0}), 25.0);
  EXPECT_GT(route.distance_m({60.0, 0.0}), 15.0);
  EXPECT_LT(route.length_m(), 420.0);
}

TEST(Planner, SaysWhichWaypointCannotBeReached) {
  const Terrain terrain(smooth_ground(), 1, plane_raster(0.0, {0.0, 0.0}, 100, 1.0));
  EXPECT_THROW(plan(terrain, {{0.0, 0.0}, {500.0, 0.0}}), Error);
}

TEST(RockPopulation, CoversTheAreaThatGolombeksLawSays) {
  const double k = 0.1, q = 1.79 + 0.152 / k, low = 0.1;
  double covered = 0.0;  // sum of the areas over fine bins of diameter
  for (double d = low; d < 4.0; d += 0.01)
    covered += RockPopulation::density(k, d, d + 0.01) * std::numbers::pi / 4.0 * std::pow(d + 0.005, 2);
  EXPECT_NEAR(covered, k * std::exp(-q * low), 0.01 * k);
}

TEST(RockField, IsTheSameFromEverywhereAndKeepsOffTheRoute) {
  TerrainOptions options = smooth_ground();
  options.rock_abundance = 0.1;
  RoverOptions rover;
  rover.length_m = 50.0;
  const Terrain terrain(options, 1, plane_raster(0.0, {0.0, 0.0}));
  const Route route(rover);
  RockField walked(terrain, route), direct(terrain, route);
  for (double x = 0.0; x < 30.0; x += 4.0) walked.around({x, 0.0}, 100.0);
  const auto from_walk = walked.around({30.0, 0.0}, 100.0), at_once = direct.around({30.0, 0.0}, 100.0);
  ASSERT_EQ(from_walk.size(), at_once.size());
  ASSERT_GT(at_once.size(), 500U);
  for (std::size_t i = 0; i < at_once.size(); ++i) {
    EXPECT_EQ(from_walk[i].p_map, at_once[i].p_map);
    const double clearance = at_once[i].diameter_m > 0.5F ? 1.0 : 0.0;
    EXPECT_GE(route.distance_m(at_once[i].p_map.head<2>()), clearance);
  }
}

TEST(RockShape, IsClosedAndOfUnitSize) {
  const RockShape shape = rock_shape(11, 3);
  EXPECT_EQ(shape.triangles.size(), 20U * 64U);
  double volume = 0.0;
  float reach = 0.0F;
  for (const auto& t : shape.triangles)
    volume += shape.vertices[t[0]].dot(shape.vertices[t[1]].cross(shape.vertices[t[2]])) / 6.0;
  for (const auto& vertex : shape.vertices) reach = std::max(reach, vertex.norm());
  EXPECT_GT(volume, 0.05);
  EXPECT_LT(volume, 0.6);
  EXPECT_LT(reach, 0.65F);
}

}  // namespace
}  // namespace demslam

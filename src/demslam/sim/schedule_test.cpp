#include "demslam/sim/schedule.h"
#include "demslam/geometry/angle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/sim/recorded_route.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensors.h"
#include "demslam/sim/sun_position.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

RoverOptions around_a_corner() {
  RoverOptions rover;
  rover.route = RouteKind::legs;
  rover.waypoints_m = {{0.0, 0.0}, {10.0, 0.0}, {10.0, 5.0}};
  rover.speed_m_per_s = 0.5;
  rover.turn_rate_deg_per_s = 30.0;
  return rover;
}

TEST(Schedule, TurnsOnTheSpotBetweenTwoLegs) {
  const RoverOptions rover = around_a_corner();
  const Route route(rover);
  const Schedule schedule(rover, route);
  EXPECT_NEAR(schedule.duration_s(), 20.0 + 3.0 + 10.0, 1e-9);
  EXPECT_NEAR(schedule.at(21.5).s_m, 10.0, 1e-9);
  EXPECT_NEAR(schedule.at(21.5).heading, 45.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(schedule.at(10.0).heading, 0.0, 1e-9);
  EXPECT_NEAR(schedule.at(28.0).heading, 90.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(schedule.at(28.0).s_m, 12.5, 1e-9);
}

TEST(Schedule, StandsStillWhereItIsToldTo) {
  RoverOptions rover;
  rover.length_m = 10.0;
  rover.stop_every_m = 4.0;
  rover.stop_s = 5.0;
  const Route route(rover);
  const Schedule schedule(rover, route);
  EXPECT_NEAR(schedule.duration_s(), 10.0 / 0.5 + 2.0 * 5.0, 1e-9);
  EXPECT_NEAR(schedule.at(8.0).s_m, 4.0, 1e-9);
  EXPECT_NEAR(schedule.at(12.9).s_m, 4.0, 1e-9);
  EXPECT_NEAR(schedule.at(15.0).s_m, 5.0, 1e-9);
  EXPECT_NEAR(schedule.at(1e9).s_m, 10.0, 1e-9);
}

TEST(Schedule, SlowsDownInATightBend) {
  RoverOptions rover;
  rover.route = RouteKind::waypoints;
  rover.waypoints_m = {{0.0, 0.0}, {10.0, 0.0}, {10.0, 1.0}, {0.0, 1.0}};
  rover.speed_m_per_s = 2.0;
  const Route route(rover);
  const Schedule schedule(rover, route);
  EXPECT_GT(schedule.duration_s(), route.length_m() / 2.0 + 2.0);
  EXPECT_NEAR(schedule.at(2.0).s_m, 4.0, 1e-9);  // straight on
  double fastest = 0.0;
  for (double t = 0.0; t + 0.5 < schedule.duration_s(); t += 0.1) {
    const double turn = schedule.at(t + 0.5).heading - schedule.at(t).heading;
    fastest = std::max(fastest, std::abs(std::remainder(turn, 2.0 * std::numbers::pi)) / 0.5);
  }
  EXPECT_LT(fastest, 36.0 * kRadPerDeg);  // measured over other stretches than the schedule does
}

TEST(Rover, FramesGoOnWhileItTurnsOnTheSpot) {
  const RoverOptions rover = around_a_corner();
  const Trajectory trajectory = drive(Terrain(smooth_ground(), 1, plane_raster(0.0, {0.0, 0.0})), rover, Route(rover));
  ASSERT_EQ(trajectory.size(), 34U);
  EXPECT_LT((trajectory[20].pose.translation() - trajectory[23].pose.translation()).norm(), 1e-9);
  EXPECT_NEAR(yaw_of(trajectory[21].pose.rotation()), 30.0 * kRadPerDeg, 1e-6);
}

TEST(Rover, SixWheelsStandOnAPlaneAsFourDo) {
  const Terrain terrain(smooth_ground(), 1, plane_raster(2.0, {0.1, -0.25}));
  RoverOptions six;
  six.wheels = 6;
  const Pose a = standing_pose(terrain, RoverOptions{}, {3.0, 4.0}, 0.7),
             b = standing_pose(terrain, six, {3.0, 4.0}, 0.7);
  EXPECT_LT((a.inverse() * b).log().norm(), 1e-5);
}

TEST(Wheels, SlipUphill) {
  const double climb = 10.0 * kRadPerDeg;
  const PoseAtTime up = [&](double t) {
    return Pose(rotation_from_rpy(0.0, -climb, 0.0), Eigen::Vector3d(std::cos(climb) * t, 0.0, std::sin(climb) * t));
  };
  RoverOptions rover;
  rover.slip_percent_per_deg = 1.0;
  const std::string text = wheels_text(up, 0, 50.0, rover, 3);
  const std::string last = text.substr(text.rfind('\n', text.size() - 2) + 1);
  EXPECT_NEAR(std::stod(last.substr(last.find(',') + 1)), 1.1 * 50.0, 0.2);
}

TEST(RecordedRoute, LeadsThroughThePlacesOfATrajectory) {
  const auto file = std::filesystem::path(testing::TempDir()) / "recorded_route.tum";
  std::ofstream(file) << "# seconds x y z qx qy qz qw\n0.0 1 2 0 0 0 0 1\n0.1 1.1 2 0 0 0 0 1\n5 4 2 0 0 0 0 1\n";
  const std::vector<Eigen::Vector2d> places = recorded_places(file);
  ASSERT_EQ(places.size(), 2U);
  EXPECT_EQ(places[1], Eigen::Vector2d(4.0, 2.0));
  std::ofstream(file) << "0.0 1 2 0 0 0 0 1\n1.0 two 2 0\n";
  EXPECT_THAT([&] { recorded_places(file); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("recorded_route.tum:2:")));
  EXPECT_THROW(recorded_places("nowhere.tum"), Error);
}

TEST(SunPosition, StandsWhereTimeAndPlaceSayAndIsRefusedBelowTheHorizon) {
  LightOptions light;
  light.utc = "1969-07-20T20:17:40Z";
  light.latitude_deg = 0.674;
  light.longitude_deg = 23.473;
  const LightOptions apollo_11 = light_at_time(light, LocalFrame{});
  EXPECT_NEAR(apollo_11.sun_elevation_deg, 10.65, 0.5);
  EXPECT_NEAR(apollo_11.sun_azimuth_deg, 0.0, 3.0);  // from the East
  light.longitude_deg = -60.0;
  EXPECT_THAT([&] { light_at_time(light, LocalFrame{}); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("below the horizon")));
  light.utc.clear();
  EXPECT_EQ(light_at_time(light, LocalFrame{}).sun_elevation_deg, light.sun_elevation_deg);
}

}  // namespace
}  // namespace demslam

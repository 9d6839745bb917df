#include "demslam/sim/sensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "demslam/sim/lens.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

/// The numbers of every line that is not a comment.
std::vector<std::vector<double>> table(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

Eigen::Vector3d mean(const std::vector<std::vector<double>>& rows, int first) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& row : rows) sum += Eigen::Vector3d(row[first], row[first + 1], row[first + 2]);
  return sum / static_cast<double>(rows.size());
}

TEST(Lens, DistortionAndItsInverseAgree) {
  Camera camera{.width = 640, .height = 480, .fx = 400.0, .fy = 410.0, .cx = 320.0, .cy = 240.0};
  camera.distortion = Distortion::radtan;
  camera.coefficients = {-0.25, 0.07, 1e-3, -5e-4, 0.0};
  for (double u = 0.0; u < 640.0; u += 53.0) {
    for (double v = 0.0; v < 480.0; v += 47.0) {
      const Eigen::Vector2d image = distorted(camera, ray_of(camera, u, v).head<2>());
      EXPECT_NEAR(camera.fx * image.x() + camera.cx, u, 1e-6);
      EXPECT_NEAR(camera.fy * image.y() + camera.cy, v, 1e-6);
    }
  }
}

TEST(Imu, AtRestFeelsGravityAndItsBias) {
  const PoseAtTime still = [](double) {
    return Pose(rotation_from_rpy(0.0, 0.2, 0.0), Eigen::Vector3d(1.0, 2.0, 3.0));
  };
  const auto rows = table(imu_text(still, 5, 60.0, 8));
  ASSERT_EQ(rows.size(), 6001U);
  const ImuBias bias = imu_bias(8);
  EXPECT_LT((mean(rows, 1) - bias.gyro).norm(), 2e-4);
  const Eigen::Vector3d gravity = rotation_from_rpy(0.0, 0.2, 0.0).conjugate() * Eigen::Vector3d(0.0, 0.0, 1.625);
  EXPECT_LT((mean(rows, 4) - gravity - bias.accelerometer).norm(), 2e-3);
}

TEST(Imu, FeelsATurnAndItsCentripetalPull) {
  const double radius = 4.0, rate = 0.3;
  const PoseAtTime circle = [&](double t) {
    return Pose(rotation_from_rpy(0.0, 0.0, rate * t),
                Eigen::Vector3d(radius * std::sin(rate * t), radius * (1.0 - std::cos(rate * t)), 0.0));
  };
  const auto rows = table(imu_text(circle, 0, 60.0, 8));
  EXPECT_NEAR(mean(rows, 1).z(), rate, 1e-3);
  EXPECT_NEAR(mean(rows, 4).y(), rate * rate * radius, 0.01);
}

TEST(SunSensor, SeesTheSunWhereItStandsWithinItsNoise) {
  const Eigen::Vector3d sun = Eigen::Vector3d(1.0, 2.0, 0.3).normalized();
  Trajectory drive;
  for (int i = 0; i < 400; ++i) {
    drive.push_back({i, Pose(rotation_from_rpy(0.05, -0.1, 0.02 * i), Eigen::Vector3d(i, 0.0, 0.0))});
  }
  double squared_deg = 0.0;
  const auto rows = table(sun_text(drive, sun, 0.5, 3));
  ASSERT_EQ(rows.size(), drive.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Vector3d seen = drive[i].pose.rotation() * Eigen::Vector3d(rows[i][1], rows[i][2], rows[i][3]);
    squared_deg += std::pow(std::atan2(seen.cross(sun).norm(), seen.dot(sun)) * 180.0 / std::numbers::pi, 2);
    EXPECT_NEAR(rows[i][5], sun.x(), 1e-6);
  }
  EXPECT_NEAR(std::sqrt(squared_deg / static_cast<double>(rows.size())), 0.5 * std::numbers::sqrt2, 0.05);
}

TEST(Wheels, MeasureTheWayOfEachSide) {
  const PoseAtTime arc = [](double t) {  // radius 10 m to the left, 1 m/s
    return Pose(rotation_from_rpy(0.0, 0.0, 0.1 * t),
                Eigen::Vector3d(10.0 * std::sin(0.1 * t), 10.0 * (1.0 - std::cos(0.1 * t)), 0.0));
  };
  const auto last = table(wheels_text(arc, 0, 20.0, RoverOptions{}, 3)).back();
  EXPECT_NEAR(last[1], 20.0 * 0.95, 0.1);
  EXPECT_NEAR(last[2], 20.0 * 1.05, 0.1);
}

/// Smooth ground at height 3 m with one rock, seen by everything.
struct Yard {
  Yard()
      : scene(closed_form_scene()),
        terrain(scene.terrain, 1, plane_raster(3.0, {0.0, 0.0})),
        route(scene.rover),
        renderer(scene, terrain, route) {
    Rock rock;
    rock.p_map = {4.0, 0.0, 3.4};
    renderer.place(rock);
    renderer.centre_on({0.0, 0.0});
  }
  SceneOptions scene;
  Terrain terrain;
  Route route;
  Renderer renderer;
};

TEST(Lidar, SeesThePlaneAndTheRock) {
  const Yard yard;
  const Lidar lidar;
  const Pose T_map_lidar = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 3.0)) * lidar.T_body_lidar;
  const auto rows = table(lidar_text(lidar.scan(yard.renderer, yard.terrain, T_map_lidar, 4)));
  ASSERT_GT(rows.size(), 20000U);
  int rocks = 0;
  for (const auto& row : rows) {
    EXPECT_LE(std::hypot(row[0], row[1], row[2]), Lidar::kRangeM + 0.1);
    if (row[3] == 174.0) {
      ++rocks;
      EXPECT_NEAR(Eigen::Vector3d(row[0] - 3.0, row[1], row[2] + 1.3).norm(), 0.5, 0.06);  // the sphere
    } else {
      EXPECT_NEAR(row[2], -1.7, 0.06);
    }
  }
  EXPECT_GT(rocks, 100);
}

TEST(Labels, TellSkyGroundAndRockApart) {
  const Yard yard;
  const StereoRig rig = stereo_rig(yard.scene.camera);
  const Pose T_map_left = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 3.0)) * rig.T_body_left;
  const Image labels = label_image(yard.renderer.render(rig.left, T_map_left), rig.left, T_map_left, yard.terrain);
  EXPECT_EQ(labels.at(64, 2), 0);
  EXPECT_EQ(labels.at(10, 120), 1);
  EXPECT_GT(std::count(labels.pixels.begin(), labels.pixels.end(), 3), 100);
}

TEST(Labels, MarkTheInsideOfCraters) {
  SceneOptions scene = closed_form_scene();
  scene.terrain.crater_density = 3.0;
  const Terrain terrain(scene.terrain, 1, plane_raster(0.0, {0.0, 0.0}));
  Rendering flat;
  flat.width = flat.height = 100;
  flat.depth_m.assign(10000, 10.0F);
  flat.surface.assign(10000, Surface::ground);
  const Camera camera{.width = 100, .height = 100, .fx = 100.0, .fy = 100.0, .cx = 49.5, .cy = 49.5};
  const Pose T_map_camera(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0),
                          Eigen::Vector3d(0.0, 0.0, 10.0));  // looks straight down
  const Image labels = label_image(flat, camera, T_map_camera, terrain);
  for (const Crater& crater : terrain.craters({0.0, 0.0}, 4.0, 1.0)) {
    if (crater.depth_m < 0.05 * crater.diameter_m) continue;
    const int u = static_cast<int>(std::lround(49.5 + 10.0 * crater.x_m)),
              v = static_cast<int>(std::lround(49.5 - 10.0 * crater.y_m));
    const bool seen = u >= 0 && u < 100 && v >= 0 && v < 100;
    EXPECT_TRUE(!seen || labels.at(u, v) == 2) << u << " " << v;
  }
  EXPECT_GT(std::count(labels.pixels.begin(), labels.pixels.end(), 1), 1000);
}

}  // namespace
}  // namespace demslam

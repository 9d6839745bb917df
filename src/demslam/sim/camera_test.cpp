// The camera: lens, shutter, sensor and stray light, each against its closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/geometry/angle.h"
#include "demslam/sim/glare.h"
#include "demslam/sim/lens.h"
#include "demslam/sim/mission.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

std::size_t pixel_of(const Rendering& image, int u, int v) { return static_cast<std::size_t>(v) * image.width + u; }

/// A plane at height 3 m under a camera, with a white sphere ahead, 8 m above it.
struct Studio {
  explicit Studio(const SceneOptions& options)
      : scene(options),
        terrain(scene.terrain, scene.seed, plane_raster(3.0, Eigen::Vector2d::Zero())),
        route(scene.rover),
        rig(stereo_rig(scene.camera)),
        renderer(scene, terrain, route) {
    Rock sphere;
    sphere.p_map = {4.0, 0.0, 11.0};
    sphere.diameter_m = 1.0F;
    renderer.place(sphere);
    renderer.centre_on({0.0, 0.0});
  }
  /// Level, towards the sphere.
  Pose T_map_camera() const { return Pose(R_body_camera_level(), Eigen::Vector3d(0.0, 0.0, 11.0)); }
  /// First and last column of a row in which the sphere is seen with some light.
  std::pair<int, int> extent(const Rendering& image, int v) const {
    int first = image.width, last = -1;
    for (int u = 0; u < image.width; ++u) {
      if (image.radiance[pixel_of(image, u, v)] <= 0.0F) continue;
      first = std::min(first, u);
      last = std::max(last, u);
    }
    return {first, last};
  }

  SceneOptions scene;
  Terrain terrain;
  Route route;
  StereoRig rig;
  Renderer renderer;
};

SceneOptions lit_from_behind_the_camera() {
  SceneOptions scene = closed_form_scene();
  scene.light.sun_azimuth_deg = 180.0;
  scene.light.sun_elevation_deg = 5.0;
  return scene;
}

Shutter sideways(double speed_m_per_s) {
  Shutter shutter;
  shutter.twist[3] = speed_m_per_s;
  return shutter;
}

TEST(Lens, FisheyeSpreadsAnglesEvenly) {
  CameraOptions options;
  options.lens = Lens::fisheye;
  options.horizontal_fov_deg = 120.0;
  const Camera camera = stereo_rig(options).left;
  const Eigen::Vector3d edge = ray_of(camera, camera.cx + 512.0, camera.cy),
                        half = ray_of(camera, camera.cx + 256.0, camera.cy);
  EXPECT_NEAR(std::atan(edge.x()), 60.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(std::atan(half.x()), 30.0 * kRadPerDeg, 1e-9);
}

TEST(Lens, FisheyeDistortionAndItsInverseAgree) {
  Camera camera{.width = 640, .height = 480, .fx = 300.0, .fy = 305.0, .cx = 320.0, .cy = 240.0};
  camera.distortion = Distortion::equidistant;
  camera.coefficients = {-0.02, 0.008, -0.001, 0.0002, 0.0};
  for (double u = 0.0; u < 640.0; u += 53.0) {
    for (double v = 0.0; v < 480.0; v += 47.0) {
      const Eigen::Vector2d image = distorted(camera, ray_of(camera, u, v).head<2>());
      EXPECT_NEAR(camera.fx * image.x() + camera.cx, u, 1e-6);
      EXPECT_NEAR(camera.fy * image.y() + camera.cy, v, 1e-6);
    }
  }
}

TEST(Lens, FisheyeRendersWhereItsModelProjects) {
  SceneOptions scene = lit_from_behind_the_camera();
  scene.camera.lens = Lens::fisheye;
  scene.camera.horizontal_fov_deg = 140.0;
  const Studio studio(scene);
  const Pose T = Pose(Eigen::Quaterniond(Eigen::AngleAxisd(40.0 * kRadPerDeg, Eigen::Vector3d::UnitZ())),
                      Eigen::Vector3d::Zero()) *
                 Pose(R_body_camera_level(), Eigen::Vector3d::Zero());
  const Rendering image =
      studio.renderer.render(studio.rig.left, Pose(T.rotation(), studio.T_map_camera().translation()));
  double sum = 0.0, count = 0.0;
  for (int u = 0; u < image.width; ++u) {
    if (image.surface[pixel_of(image, u, 64)] != Surface::rock) continue;
    sum += u;
    count += 1.0;
  }
  ASSERT_GT(count, 3.0);
  // The sphere stands 40 degrees to the right; its outline is even about that angle.
  EXPECT_NEAR(sum / count, studio.rig.left.cx + studio.rig.left.fx * 40.0 * kRadPerDeg, 0.6);
}

TEST(Shutter, MotionBlurIsAsLongAsTheImageMovesDuringTheExposure) {
  SceneOptions scene = lit_from_behind_the_camera();
  scene.camera.exposure_time_s = 0.1;
  constexpr int kRow = 60;  // above the horizon
  const Studio studio(scene);
  Shutter shutter = sideways(3.0);
  const Rendering still = studio.renderer.render(studio.rig.left, studio.T_map_camera(), shutter);
  shutter.exposure_s = 0.1;
  const Rendering moved = studio.renderer.render(studio.rig.left, studio.T_map_camera(), shutter);
  const auto [still_first, still_last] = studio.extent(still, kRow);
  const auto [first, last] = studio.extent(moved, kRow);
  const double path = studio.rig.left.fx * 3.0 * 0.1 / std::sqrt(4.0 * 4.0 - 0.25);  // of the outline's distance
  EXPECT_NEAR((last - first) - (still_last - still_first), path * 4.0 / 5.0, 1.1);   // five moments span four fifths
  double light = 0.0, light_moved = 0.0;
  for (int u = 0; u < 128; ++u) {
    light += still.radiance[pixel_of(still, u, kRow)];
    light_moved += moved.radiance[pixel_of(moved, u, kRow)];
  }
  EXPECT_NEAR(light_moved, light, 0.05 * light);  // spread out, not lost
  EXPECT_EQ(moved.depth_m[pixel_of(moved, 64, kRow)], still.depth_m[pixel_of(still, 64, kRow)]);  // of mid-exposure
}

TEST(Shutter, RollingShutterSlantsWhatPassesBy) {
  const Studio studio(lit_from_behind_the_camera());
  Shutter shutter = sideways(3.0);
  shutter.readout_s = 0.4;
  const Rendering image = studio.renderer.render(studio.rig.left, studio.T_map_camera(), shutter);
  const auto middle = [&](int v) {
    const auto [first, last] = studio.extent(image, v);
    return 0.5 * (first + last);
  };
  const double px_per_row = studio.rig.left.fx * 3.0 / 4.0 * 0.4 / 127.0;
  EXPECT_NEAR(middle(68) - middle(58), -10.0 * px_per_row, 1.1);
  EXPECT_NEAR(middle(63), studio.rig.left.cx, 1.0);  // the pose is the middle row's
}

TEST(Sun, StandsWhereItsDirectionProjectsAndSaturates) {
  SceneOptions scene = closed_form_scene();
  scene.light.sun_diameter_deg = 3.0;
  const Studio studio(scene);
  const Pose T = studio.T_map_camera() * Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, -3.0, 0.0));
  const SunInView sun = find_sun(studio.renderer, scene.light, studio.rig.left, T);
  EXPECT_EQ(sun.seen, 1.0);
  EXPECT_NEAR(sun.pixel.y(), studio.rig.left.cy - studio.rig.left.fy * std::tan(30.0 * kRadPerDeg), 1e-6);
  Rendering image = studio.renderer.render(studio.rig.left, T);
  add_sun(image, studio.rig.left, scene.light, sun, 0.0);
  const int u = static_cast<int>(std::lround(sun.pixel.x())), v = static_cast<int>(std::lround(sun.pixel.y()));
  const Levels levels = develop(image, scene.camera, 2.0, 1);
  EXPECT_EQ(levels.values[pixel_of(image, u, v)], 255);
  EXPECT_EQ(levels.values[pixel_of(image, u + 6, v)], 0);  // black sky beside it
}

TEST(Sun, IsHiddenByWhatStandsBeforeIt) {
  SceneOptions scene = closed_form_scene();
  scene.light.sun_elevation_deg = 0.5;
  scene.light.sun_diameter_deg = 0.53;
  const Studio studio(scene);  // the sphere stands in the East, before the sun
  EXPECT_EQ(find_sun(studio.renderer, scene.light, studio.rig.left, studio.T_map_camera()).seen, 0.0);
}

TEST(Flare, VeilFallsWithTheAngleAndNeedsTheSun) {
  LightOptions light;
  Rendering image;
  image.width = image.height = 128;
  image.radiance.assign(128 * 128, 0.0F);
  image.surface.assign(128 * 128, Surface::ground);
  const Camera camera{.width = 128, .height = 128, .fx = 64.0, .fy = 64.0, .cx = 63.5, .cy = 63.5};
  Rendering dark = image;
  add_sun(dark, camera, light, {{20.0, 20.0}, 0.3, 0.0}, 1.0);
  EXPECT_EQ(dark.radiance, image.radiance);
  add_sun(image, camera, light, {{20.0, 20.0}, 0.3, 0.5}, 2.0);
  const double angle_deg = 30.0 / 64.0 / kRadPerDeg;
  EXPECT_NEAR(image.radiance[pixel_of(image, 20, 50)],
              0.3 * 2.0 * std::numbers::pi * 0.5 / (angle_deg * angle_deg + 1.0), 1e-5);
  // One of the ghosts lies across the image's middle.
  EXPECT_GT(image.radiance[pixel_of(image, 98, 98)], image.radiance[pixel_of(image, 98, 90)] + 0.005F);
}

Rendering ramp() {
  Rendering image;
  image.width = image.height = 256;
  for (int i = 0; i < 256 * 256; ++i) image.radiance.push_back(static_cast<float>(i) / 65536.0F);
  return image;
}

CameraOptions perfect_sensor(int bits) {
  CameraOptions camera;
  camera.bits = bits;
  camera.gamma = 1.0;
  camera.full_well_e = camera.blur_px = camera.vignetting = 0.0;
  return camera;
}

TEST(Sensor, MoreBitsGiveFinerStepsOfTheSameImage) {
  const Levels coarse = develop(ramp(), perfect_sensor(8), 1.0, 1), fine = develop(ramp(), perfect_sensor(12), 1.0, 1);
  EXPECT_EQ(coarse.values.back(), 255);
  EXPECT_EQ(fine.values.back(), 4095);
  EXPECT_EQ(fine.values[65536 / 2], 2048);
  EXPECT_EQ(fine.aligned()[65536 / 2], 2048 << 4);
  for (std::size_t i = 0; i < 65536; i += 97) EXPECT_NEAR(fine.upper_byte().pixels[i], coarse.values[i], 1.0);
}

TEST(Sensor, DustIsTheSameInEveryImageOfACamera) {
  Rendering card;
  card.width = card.height = 256;
  card.radiance.assign(65536, 0.5F);
  CameraOptions camera = perfect_sensor(8);
  camera.dust_spots = 12;
  const Levels first = develop(card, camera, 1.0, 1, 5), second = develop(card, camera, 1.0, 2, 5);
  EXPECT_EQ(first.values, second.values);
  EXPECT_NE(first.values, develop(card, camera, 1.0, 1, 6).values);
  const auto darkest = *std::min_element(first.values.begin(), first.values.end());
  EXPECT_LT(darkest, 123);
  EXPECT_GE(darkest, 128 * 0.4);  // two spots may overlap
  EXPECT_GT(std::count(first.values.begin(), first.values.end(), 128), 50000);
}

TEST(Mission, ExposureFollowsTheLightAndDoesNotDependOnTheFramesAskedForBefore) {
  SceneOptions scene;
  scene.terrain.size_m = 120.0;
  scene.camera.width_px = scene.camera.height_px = 64;
  scene.camera.exposure_memory_s = 2.0;
  scene.rover.length_m = 3.0;
  scene.output.depth = false;
  Mission straight(scene), jumping(scene);
  std::vector<double> exposures;
  for (std::size_t i = 0; i < straight.trajectory().size(); ++i) exposures.push_back(straight.exposure(i));
  EXPECT_EQ(jumping.exposure(5), exposures[5]);
  EXPECT_EQ(jumping.exposure(2), exposures[2]);
  EXPECT_NE(exposures[5], exposures[0]);
  EXPECT_EQ(jumping.frame(3).left.pixels, straight.frame(3).left.pixels);
}

TEST(Mission, WritesNormalsThatAreUnitAndUpOnTheGround) {
  SceneOptions scene;
  scene.terrain.size_m = 120.0;
  scene.camera.width_px = scene.camera.height_px = 64;
  scene.rover.length_m = 2.0;
  scene.output.normals = true;
  Mission mission(scene);
  const SimulatedFrame frame = mission.frame(0);
  ASSERT_EQ(frame.normals.size(), 64U * 64U);
  EXPECT_EQ(frame.normals.front().norm(), 0.0F);  // sky
  EXPECT_NEAR(frame.normals.back().norm(), 1.0F, 1e-5F);
  float up = 0.0F;
  for (int u = 0; u < 64; ++u) up += frame.normals[63 * 64 + u].z() / 64.0F;
  EXPECT_GT(up, 0.8F);
}

}  // namespace
}  // namespace demslam

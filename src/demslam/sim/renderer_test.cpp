#include "demslam/sim/renderer.h"
#include "demslam/geometry/angle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/photometry.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

/// A renderer over a plane, and one camera of it.
struct Studio {
  explicit Studio(const SceneOptions& options, const Eigen::Vector2d& slope = Eigen::Vector2d::Zero())
      : scene(options),
        terrain(scene.terrain, scene.seed, plane_raster(3.0, slope)),
        route(scene.rover),
        rig(stereo_rig(scene.camera)),
        renderer(scene, terrain, route) {
    renderer.centre_on({0.0, 0.0});
  }

  /// Camera at a height over the plane at the origin, looking along the heading, pitched down.
  Pose T_map_camera(double height_m, double pitch_deg, double heading_deg = 0.0) const {
    return Pose(rotation_from_rpy(0.0, pitch_deg * kRadPerDeg, heading_deg * kRadPerDeg) * R_body_camera_level(),
                Eigen::Vector3d(0.0, 0.0, 3.0 + height_m));
  }
  Rendering look(const Pose& T) const { return renderer.render(rig.left, T); }

  SceneOptions scene;
  Terrain terrain;
  Route route;
  StereoRig rig;
  Renderer renderer;
};

Rock sphere(const Eigen::Vector3d& centre, double diameter) {
  Rock rock;
  rock.p_map = centre;
  rock.diameter_m = static_cast<float>(diameter);
  return rock;
}

std::size_t pixel_of(const Rendering& image, int u, int v) { return static_cast<std::size_t>(v) * image.width + u; }

TEST(Renderer, LambertPlaneHasTheRadianceOfTheClosedForm) {
  const Studio studio(closed_form_scene());
  const Rendering image = studio.look(studio.T_map_camera(1.5, 90.0));
  for (const float radiance : image.radiance) EXPECT_NEAR(radiance, 0.5 * std::sin(30.0 * kRadPerDeg), 1e-4);
}

TEST(Renderer, TiltedLambertPlaneFollowsTheCosine) {
  const Studio studio(closed_form_scene(), {0.2, -0.1});
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.2, 0.1, 1.0).normalized();
  const Eigen::Vector3d sun(std::cos(30.0 * kRadPerDeg), 0.0, std::sin(30.0 * kRadPerDeg));
  const Rendering image = studio.look(studio.T_map_camera(1.5, 90.0));
  EXPECT_NEAR(image.radiance[pixel_of(image, 64, 64)], 0.5 * normal.dot(sun), 1e-4);
}

TEST(Renderer, DepthOfAPlaneIsExactAndThePixelCentreIsTheIntegerCoordinate) {
  const Studio studio(closed_form_scene());
  const double pitch = 40.0 * kRadPerDeg, height = 1.5;
  const Rendering image = studio.look(studio.T_map_camera(height, 40.0));
  const Camera& camera = studio.rig.left;
  for (int v = 10; v < 128; v += 9) {
    // A ray (0, y, 1) of the camera falls by sin(pitch) + y cos(pitch) per unit of depth.
    const double y = (v - camera.cy) / camera.fy;
    const double depth = height / (std::sin(pitch) + y * std::cos(pitch));
    if (depth > Clipmap::kFlat) continue;  // there the Moon's curvature is shown
    EXPECT_NEAR(image.depth_m[pixel_of(image, 64, v)], depth, 2e-5 * depth) << v;
  }
}

TEST(Renderer, SkyIsBlackAndInfinitelyFar) {
  const Studio studio(closed_form_scene());
  const Rendering image = studio.look(studio.T_map_camera(1.5, 0.0));
  EXPECT_EQ(image.radiance[pixel_of(image, 64, 5)], 0.0F);
  EXPECT_TRUE(std::isinf(image.depth_m[pixel_of(image, 64, 5)]));
  EXPECT_EQ(image.surface[pixel_of(image, 64, 5)], Surface::sky);
  EXPECT_EQ(image.surface[pixel_of(image, 64, 120)], Surface::ground);
}

/// A bright sphere before the black sky, over bright ground with its shadow.
Rendering look_at_edges(bool smooth_edges, int samples_per_axis) {
  SceneOptions scene = closed_form_scene();
  scene.camera.smooth_edges = smooth_edges;
  scene.camera.samples_per_axis = samples_per_axis;
  Studio studio(scene);
  studio.renderer.place(sphere({4.0, 0.3, 4.2}, 1.5));
  studio.renderer.centre_on({0.0, 0.0});
  return studio.look(studio.T_map_camera(1.5, 10.0));
}

TEST(Renderer, PixelsOnEdgesAreMeansOverTheirArea) {
  const Rendering point = look_at_edges(false, 1), smooth = look_at_edges(true, 1), area = look_at_edges(false, 8);
  double error_of_points = 0.0, error = 0.0;
  int changed = 0;
  for (std::size_t i = 0; i < point.radiance.size(); ++i) {
    if (smooth.radiance[i] == point.radiance[i]) continue;
    ++changed;
    error_of_points += std::pow(point.radiance[i] - area.radiance[i], 2);
    error += std::pow(smooth.radiance[i] - area.radiance[i], 2);
  }
  EXPECT_GT(changed, 100);
  EXPECT_LT(changed, static_cast<int>(point.radiance.size()) / 10);  // edges, not surfaces
  EXPECT_LT(std::sqrt(error), 0.4 * std::sqrt(error_of_points));
  EXPECT_EQ(smooth.depth_m, point.depth_m);
  EXPECT_EQ(smooth.surface, point.surface);
}

/// Rough ground without rocks under a low sun: texture, and the shadows of small slopes.
Rendering look_at_ground(bool smooth_edges, int samples_per_axis) {
  SceneOptions scene = closed_form_scene();
  scene.terrain = TerrainOptions{};
  scene.terrain.size_m = 100.0;
  scene.terrain.rock_abundance = 0.0;
  scene.light.sun_elevation_deg = 10.0;
  scene.camera.smooth_edges = smooth_edges;
  scene.camera.samples_per_axis = samples_per_axis;
  const Terrain terrain(scene.terrain, 5);
  const Route route(scene.rover);
  const StereoRig rig = stereo_rig(scene.camera);
  Renderer renderer(scene, terrain, route);
  renderer.centre_on({3.0, 0.0});
  return renderer.render(rig.left, standing_pose(terrain, scene.rover, {0.0, 0.0}, 0.0) * rig.T_body_left);
}

TEST(Renderer, RoughGroundIsSmoothedWithTheLightOfItsSurroundings) {
  const Rendering point = look_at_ground(false, 1), smooth = look_at_ground(true, 1), area = look_at_ground(false, 8);
  double error_of_points = 0.0, error = 0.0, bias = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < point.radiance.size(); ++i) {
    sum += area.radiance[i];
    bias += smooth.radiance[i] - area.radiance[i];
    error_of_points += std::pow(point.radiance[i] - area.radiance[i], 2);
    error += std::pow(smooth.radiance[i] - area.radiance[i], 2);
  }
  EXPECT_LT(std::sqrt(error), 0.6 * std::sqrt(error_of_points));
  EXPECT_LT(std::abs(bias), 0.02 * sum);
}

TEST(Renderer, SphereShowsLambertsLawAndItsTerminator) {
  SceneOptions scene = closed_form_scene();
  scene.light.sun_azimuth_deg = 100.0;  // from the side: half of what is seen is lit
  Studio studio(scene);
  const Eigen::Vector3d centre(3.0, 0.0, 8.0);
  studio.renderer.place(sphere(centre, 2.0));
  studio.renderer.centre_on({0.0, 0.0});
  const Pose T = Pose(R_body_camera_level(), Eigen::Vector3d(0.0, 0.0, 8.0));
  const Eigen::Vector3d sun(std::cos(30.0 * kRadPerDeg) * std::cos(100.0 * kRadPerDeg),
                            std::cos(30.0 * kRadPerDeg) * std::sin(100.0 * kRadPerDeg), std::sin(30.0 * kRadPerDeg));
  const Rendering image = studio.look(T);
  int lit = 0, dark = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const std::size_t i = pixel_of(image, u, v);
      if (image.surface[i] != Surface::rock) continue;
      const Camera& camera = studio.rig.left;
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const double cosine = (T * Eigen::Vector3d(image.depth_m[i] * ray) - centre).normalized().dot(sun);
      EXPECT_NEAR(image.radiance[i], 0.5 * std::max(0.0, cosine), 4e-3);
      cosine > 0.0 ? ++lit : ++dark;
    }
  }
  EXPECT_GT(lit, 100);
  EXPECT_GT(dark, 100);
}

TEST(Renderer, ShadowEndsWhereTheSunsElevationSays) {
  Studio studio(closed_form_scene());
  const double above = 1.0, radius = 0.25, elevation = 30.0 * kRadPerDeg;
  studio.renderer.place(sphere({0.0, 0.0, 3.0 + above}, 2.0 * radius));
  studio.renderer.centre_on({0.0, 0.0});
  // From straight above, image columns run along +x (East); the sun stands in the East, the shadow falls to the West.
  const Pose T(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d(-1.5, 0.0, 3.0 + 4.0));
  const Rendering image = studio.look(T);
  const Camera& camera = studio.rig.left;
  double west = 1e9, east = -1e9;
  const int v = 64;
  for (int u = 0; u < image.width; ++u) {
    const std::size_t i = pixel_of(image, u, v);
    if (image.surface[i] != Surface::ground || image.radiance[i] > 0.0F) continue;
    const double x = -1.5 + 4.0 * (u - camera.cx) / camera.fx;
    west = std::min(west, x);
    east = std::max(east, x);
  }
  const double pixel = 4.0 / camera.fx;
  EXPECT_NEAR(west, -(above / std::tan(elevation) + radius / std::sin(elevation)), pixel);
  EXPECT_NEAR(east, -(above / std::tan(elevation) - radius / std::sin(elevation)), pixel);
}

/// Dark ground around the end of a sphere's shadow, square metres, seen from straight above.
double shadow_area_from(double height) {
  const double span = 1.0, radius = 0.15, elevation = 10.0 * kRadPerDeg;
  SceneOptions scene = closed_form_scene();
  scene.light.sun_elevation_deg = 10.0;
  scene.camera.horizontal_fov_deg = 2.0 * std::atan(0.5 * span / height) / kRadPerDeg;
  Studio studio(scene);
  studio.renderer.place(sphere({0.0, 0.0, 3.0 + radius}, 2.0 * radius));
  studio.renderer.centre_on({0.0, 0.0});
  const double end = -(radius / std::tan(elevation) + radius / std::sin(elevation));
  const Pose T(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d(end, 0.0, 3.0 + height));
  const Rendering image = studio.look(T);
  const auto dark = std::count(image.radiance.begin(), image.radiance.end(), 0.0F);
  return static_cast<double>(dark) * span * span / static_cast<double>(image.radiance.size());
}

TEST(Illumination, AShadowIsTheSameFromNearAndFar) {
  const double near = shadow_area_from(5.0), far = shadow_area_from(25.0);
  EXPECT_GT(near, 0.05);
  EXPECT_NEAR(near, far, 5e-4);  // 2 mm of its length; 2 mm of lift more would shorten it by 11 mm
}

TEST(Illumination, PenumbraIsAsWideAsTheSunsDisc) {
  SceneOptions scene = closed_form_scene();
  scene.light.sun_diameter_deg = 4.0;  // large, so that the pixels resolve it
  scene.light.sun_elevation_deg = 90.0;
  Studio studio(scene);
  const double above = 3.0, radius = 0.4;
  studio.renderer.place(sphere({0.0, 0.0, 3.0 + above}, 2.0 * radius));
  studio.renderer.centre_on({0.0, 0.0});
  const Pose T(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, 3.0 + 1.0));  // below the sphere
  const Rendering image = studio.look(T);
  // The share of the sun's disc that is seen at a distance from the shadow's middle, as a mean around the ring.
  const auto share_at = [&](double distance) {
    double sum = 0.0, count = 0.0;
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const double r = std::hypot(u - studio.rig.left.cx, v - studio.rig.left.cy) / studio.rig.left.fx;
        if (std::abs(r - distance) > 0.6 / studio.rig.left.fx) continue;
        sum += image.radiance[pixel_of(image, u, v)] / 0.5;
        count += 1.0;
      }
    }
    return sum / count;
  };
  const double penumbra = above * std::tan(2.0 * kRadPerDeg);  // half its width
  EXPECT_NEAR(share_at(radius - 1.3 * penumbra), 0.0, 1e-6);
  EXPECT_NEAR(share_at(radius - 0.5 * penumbra), 0.196, 0.06);  // a disc cut half-way to its edge
  EXPECT_NEAR(share_at(radius + 0.5 * penumbra), 0.804, 0.06);
  EXPECT_NEAR(share_at(radius + 1.3 * penumbra), 1.0, 1e-3);
}

TEST(Illumination, GroundLightsAVerticalFaceByHalfItsRadiance) {
  SceneOptions scene = closed_form_scene();
  scene.light.fill = 1.0;
  Studio studio(scene);
  const Eigen::Vector3d centre(3.0, 0.0, 8.0);
  studio.renderer.place(sphere(centre, 2.0));
  studio.renderer.centre_on({0.0, 0.0});
  const Rendering image = studio.look(Pose(R_body_camera_level(), Eigen::Vector3d(0.0, 0.0, 8.0)));
  const double middle = image.radiance[pixel_of(image, 64, 64)];  // faces West, away from the sun
  EXPECT_NEAR(middle, 0.5 * 0.5 * std::sin(30.0 * kRadPerDeg) * (0.5 + 0.02), 2e-3);
}

TEST(Illumination, ShadowedGroundLightsNothing) {
  SceneOptions scene = closed_form_scene();
  scene.light.fill = 1.0;
  Studio studio(scene);
  studio.renderer.place(sphere({3.0, 0.0, 8.0}, 2.0));  // as above, its western side seen
  // The shadow of a large sphere in the East covers the ground from which the light came.
  const double height = 15.0;
  studio.renderer.place(sphere({height / std::tan(30.0 * kRadPerDeg), 0.0, 3.0 + height}, 20.0));
  studio.renderer.centre_on({0.0, 0.0});
  const Rendering image = studio.look(Pose(R_body_camera_level(), Eigen::Vector3d(0.0, 0.0, 8.0)));
  EXPECT_LT(image.radiance[pixel_of(image, 64, 64)], 1e-3);
}

TEST(Illumination, LampFallsOffWithTheSquareOfTheDistance) {
  SceneOptions scene = closed_form_scene();
  scene.light.lamp = 10.0;
  Studio lit(scene);
  scene.light.lamp = 0.0;
  const Studio unlit(scene);
  const Pose T = lit.T_map_camera(1.5, 90.0);
  lit.renderer.set_lamp({0.0, 0.0, 3.0 + 2.0});
  const std::size_t middle = pixel_of(unlit.look(T), 64, 64);
  EXPECT_NEAR(lit.look(T).radiance[middle] - unlit.look(T).radiance[middle], 10.0 / 4.0 * 0.5, 5e-3);
}

TEST(Illumination, EarthLightsAsAFullEarthDoes) {
  SceneOptions scene = closed_form_scene();
  const Studio without(scene);
  scene.light.earthshine = 1000.0;
  scene.light.earth_elevation_deg = 40.0;
  const Studio with(scene);
  const Pose T = with.T_map_camera(1.5, 90.0);
  const std::size_t middle = pixel_of(without.look(T), 64, 64);
  const double full_earth = 0.367 * std::pow(6371.0 / 384400.0, 2);
  EXPECT_NEAR(with.look(T).radiance[middle] - without.look(T).radiance[middle],
              1000.0 * full_earth * 0.5 * std::sin(40.0 * kRadPerDeg), 1e-4);
}

TEST(Illumination, EarthCastsShadowsOfItsOwn) {
  SceneOptions scene = closed_form_scene();
  scene.light.earthshine = 1000.0;
  scene.light.earth_elevation_deg = 90.0;
  Studio studio(scene);
  studio.renderer.place(sphere({0.0, 0.0, 3.0 + 3.0}, 1.0));
  studio.renderer.centre_on({0.0, 0.0});
  const Rendering image = studio.look(studio.T_map_camera(1.5, 90.0));  // from below the sphere
  const double sun = 0.5 * std::sin(30.0 * kRadPerDeg);
  EXPECT_NEAR(image.radiance[pixel_of(image, 64, 64)], sun, 1e-4);  // the sphere hides the Earth, not the sun
  EXPECT_GT(image.radiance[pixel_of(image, 64, 120)], sun + 0.04);
}

/// Mean image position of the rock, from renderings at 5 x 5 offsets inside the pixel.
Eigen::Vector2d centroid(const Renderer& renderer, const Camera& camera, const Pose& T_map_camera) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (int k = 0; k < 25; ++k) {
    const Eigen::Vector2d offset(0.2 * (k % 5), 0.2 * (k / 5));
    Camera shifted = camera;
    shifted.cx -= offset.x();
    shifted.cy -= offset.y();
    const Rendering image = renderer.render(shifted, T_map_camera);
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        if (image.surface[pixel_of(image, u, v)] != Surface::rock) continue;
        sum += Eigen::Vector2d(u, v) + offset;
        count += 1.0;
      }
    }
  }
  return sum / count;
}

TEST(Renderer, DisparityOfAKnownPointIsFocalTimesBaselineOverDepth) {
  SceneOptions scene = closed_form_scene();
  scene.camera.width_px = scene.camera.height_px = 256;
  Studio studio(scene);
  const double depth = 2.0, radius = 0.2;
  const Pose T_map_left(R_body_camera_level(), Eigen::Vector3d(0.0, 0.0, 6.0));
  studio.renderer.place(sphere(T_map_left * Eigen::Vector3d(0.1, 0.05, depth), 2.0 * radius));
  studio.renderer.centre_on({0.0, 0.0});
  const Eigen::Vector2d left = centroid(studio.renderer, studio.rig.left, T_map_left);
  const Eigen::Vector2d right = centroid(studio.renderer, studio.rig.right, T_map_left * studio.rig.T_left_right);
  // The outline of a sphere is an ellipse about f X Z / (Z^2 - r^2): its disparity is that of a point at (Z^2 - r^2) /
  // Z.
  const double focal = studio.rig.left.fx, shown_depth = (depth * depth - radius * radius) / depth;
  EXPECT_NEAR(left.x() - right.x(), focal * scene.camera.baseline_m / shown_depth, 0.01);
  EXPECT_NEAR(left.x(), studio.rig.left.cx + focal * 0.1 / shown_depth, 0.01);
  EXPECT_NEAR(left.y(), right.y(), 0.01);
}

TEST(Renderer, LeftAndRightSeeTheSameSurface) {
  SceneOptions scene = closed_form_scene();
  scene.terrain = TerrainOptions{};
  scene.terrain.size_m = 100.0;
  const Terrain terrain(scene.terrain, 5);
  const Route route(scene.rover);
  const StereoRig rig = stereo_rig(scene.camera);
  Renderer renderer(scene, terrain, route);
  renderer.centre_on({3.0, 0.0});
  const Pose T_map_left = standing_pose(terrain, scene.rover, {0.0, 0.0}, 0.0) * rig.T_body_left;
  const Rendering left = renderer.render(rig.left, T_map_left);
  int checked = 0;
  for (int v = 70; v < 128; v += 3) {
    for (int u = 30; u < 128; u += 5) {
      const double z = left.depth_m[pixel_of(left, u, v)];
      const Eigen::Vector3d p_left(z * (u - rig.left.cx) / rig.left.fx, z * (v - rig.left.cy) / rig.left.fy, z);
      Camera needle = rig.right;  // one pixel, shifted so that its centre is the right image's point
      needle.width = needle.height = 1;
      const Eigen::Vector3d p_right = rig.T_left_right.inverse() * p_left;
      needle.cx = -rig.right.fx * p_right.x() / z;
      needle.cy = -rig.right.fy * p_right.y() / z;
      const double seen = renderer.render(needle, T_map_left * rig.T_left_right).depth_m.front();
      if (seen < z * 0.999) continue;  // hidden from the right camera
      EXPECT_NEAR(seen, z, 1e-4 * z);
      ++checked;
    }
  }
  EXPECT_GT(checked, 300);
}

TEST(Reflectance, HasTheAlbedoAtOppositionAndSurgesTowardsIt) {
  for (const Photometry model : {Photometry::lambert, Photometry::lunar_lambert, Photometry::hapke}) {
    EXPECT_NEAR(Reflectance(model, 0.12)(1.0F, 1.0F, 1.0F), 0.12, 1e-6);
    EXPECT_EQ(Reflectance(model, 0.12)(-0.1F, 1.0F, 0.5F), 0.0F);
  }
  const Reflectance hapke(Photometry::hapke, 0.12);
  const auto at_phase = [&](double deg) { return hapke(0.8F, 0.8F, static_cast<float>(std::cos(deg * kRadPerDeg))); };
  EXPECT_GT(at_phase(0.0) / at_phase(10.0), 1.3);  // the Moon brightens by some 40 % over the last ten degrees
  EXPECT_LT(at_phase(0.0) / at_phase(10.0), 2.2);
  EXPECT_GT(at_phase(10.0), at_phase(60.0));
}

TEST(Reflectance, MariaScatterLessLightBackThanHighlands) {
  const Reflectance mare(Photometry::hapke, 0.12, Soil::mare), highland(Photometry::hapke, 0.12, Soil::highland);
  const auto forward = [](const Reflectance& soil) {  // against the light to with the light
    return soil(0.5F, 0.5F, static_cast<float>(std::cos(110.0 * kRadPerDeg))) /
           soil(0.5F, 0.5F, static_cast<float>(std::cos(30.0 * kRadPerDeg)));
  };
  EXPECT_GT(forward(mare), 1.1F * forward(highland));
  EXPECT_NEAR(mare(1.0F, 1.0F, 1.0F), 0.12, 1e-6);
}

TEST(Reflectance, TheFullMoonHasNoLimbDarkening) {
  const Reflectance hapke(Photometry::hapke, 0.12);
  EXPECT_NEAR(hapke(0.3F, 0.3F, 1.0F) / hapke(1.0F, 1.0F, 1.0F), 1.0, 0.1);
}

}  // namespace
}  // namespace demslam

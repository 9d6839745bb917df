#include "demslam/sim/scene.h"

#include <array>

#include "demslam/base/error.h"
#include "demslam/sim/scene_fields.h"
#include "demslam/toml/toml.h"

namespace demslam {
namespace {

/// One range rule; the message quotes the key as the user writes it.
struct Rule {
  const char* key;
  double value, low, high;
};

void check(const Rule& rule, const std::string& source) {
  if (rule.value >= rule.low && rule.value <= rule.high) return;
  throw Error(source + ": " + rule.key + " = " + std::to_string(rule.value) + " must lie between " +
              std::to_string(rule.low) + " and " + std::to_string(rule.high));
}

void check_sun(const LightOptions& light, const std::string& source) {
  if (light.sun_elevation_deg > 0.0 && light.sun_elevation_deg <= 90.0) return;
  throw Error(source + ": light.sun_elevation_deg = " + std::to_string(light.sun_elevation_deg) +
              ": the sun is below the horizon; choose an elevation above 0 and up to 90 degrees");
}

}  // namespace

SceneOptions read_scene(const std::filesystem::path& file) {
  TomlReader reader = TomlReader::from_file(file);
  SceneOptions scene;
  scene_fields(reader, scene);
  reader.reject_unknown();
  check_scene(scene, file.string());
  std::filesystem::path& dem = scene.terrain.dem;
  if (!dem.empty() && dem.is_relative()) dem = file.parent_path() / dem;
  return scene;
}

std::string scene_toml(const SceneOptions& scene) {
  TomlWriter writer;
  SceneOptions copy = scene;
  scene_fields(writer, copy);
  return writer.text();
}

void check_scene(const SceneOptions& scene, const std::string& source) {
  check_sun(scene.light, source);
  const std::array rules{
      Rule{"terrain.size_m", scene.terrain.size_m, 20.0, 20000.0},
      Rule{"terrain.hurst", scene.terrain.hurst, 0.3, 1.0},
      Rule{"terrain.roughness", scene.terrain.roughness, 0.0, 10.0},
      Rule{"terrain.crater_density", scene.terrain.crater_density, 0.0, 3.0},
      Rule{"terrain.rock_abundance", scene.terrain.rock_abundance, 0.0, 0.3},
      Rule{"terrain.rock_max_m", scene.terrain.rock_max_m, 0.05, 10.0},
      Rule{"terrain.rock_clearance_m", scene.terrain.rock_clearance_m, 0.0, 10.0},
      Rule{"light.albedo", scene.light.albedo, 0.01, 1.0},
      Rule{"camera.width_px", static_cast<double>(scene.camera.width_px), 16, 8192},
      Rule{"camera.height_px", static_cast<double>(scene.camera.height_px), 16, 8192},
      Rule{"camera.horizontal_fov_deg", scene.camera.horizontal_fov_deg, 5.0, 150.0},
      Rule{"camera.baseline_m", scene.camera.baseline_m, 0.001, 10.0},
      Rule{"camera.height_m", scene.camera.height_m, 0.2, 20.0},
      Rule{"camera.exposure", scene.camera.exposure, 0.0, 1e6},
      Rule{"camera.gamma", scene.camera.gamma, 1.0, 4.0},
      Rule{"camera.full_well_e", scene.camera.full_well_e, 0.0, 1e7},
      Rule{"camera.read_noise_e", scene.camera.read_noise_e, 0.0, 1e5},
      Rule{"camera.blur_px", scene.camera.blur_px, 0.0, 10.0},
      Rule{"camera.samples_per_axis", static_cast<double>(scene.camera.samples_per_axis), 1, 8},
      Rule{"rover.length_m", scene.rover.length_m, 0.1, 200000.0},
      Rule{"rover.speed_m_per_s", scene.rover.speed_m_per_s, 0.001, 100.0},
      Rule{"rover.frame_rate_hz", scene.rover.frame_rate_hz, 0.001, 1000.0},
      Rule{"rover.wheelbase_m", scene.rover.wheelbase_m, 0.1, 10.0},
      Rule{"rover.track_m", scene.rover.track_m, 0.1, 10.0},
      Rule{"dem_product.cell_m", scene.dem_product.cell_m, 0.1, 1000.0},
      Rule{"dem_product.noise_rms_m", scene.dem_product.noise_rms_m, 0.0, 1000.0},
      Rule{"dem_product.correlation_m", scene.dem_product.correlation_m, 0.0, 10000.0},
      Rule{"dem_product.margin_m", scene.dem_product.margin_m, 0.0, 20000.0},
  };
  for (const Rule& rule : rules) check(rule, source);
  if (scene.rover.route == RouteKind::waypoints && scene.rover.waypoints_m.size() < 2) {
    throw Error(source + ": rover.waypoints_m needs at least two points when rover.route = \"waypoints\"");
  }
}

}  // namespace demslam

#include "demslam/sim/scene.h"

#include "demslam/sim/scene_fields.h"
#include "demslam/toml/toml.h"

namespace demslam {
namespace {

SceneOptions parsed(TomlReader reader) {
  SceneOptions scene;
  scene_fields(reader, scene);
  reader.reject_unknown();
  return scene;
}

}  // namespace

SceneOptions read_scene(const std::filesystem::path& file) {
  SceneOptions scene = parsed(TomlReader::from_file(file));
  std::filesystem::path& dem = scene.terrain.dem;
  if (!dem.empty()) dem = std::filesystem::absolute(file.parent_path() / dem);
  return scene;
}

std::string scene_toml(const SceneOptions& scene) {
  TomlWriter writer;
  SceneOptions copy = scene;
  scene_fields(writer, copy);
  return writer.text();
}

void check_scene(const SceneOptions& scene, const std::string& source) {
  parsed(TomlReader::from_text(scene_toml(scene), source));
}

}  // namespace demslam

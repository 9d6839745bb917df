#include "demslam/experiment/terrain_scenes.h"

#include <fmt/format.h>

#include <utility>

namespace demslam {
namespace {

constexpr std::pair<Relief, const char*> kReliefs[] = {
    {Relief::highland, "highland"}, {Relief::mid, "mid"}, {Relief::mare, "mare"}, {Relief::flat, "flat"}};
constexpr std::pair<double, const char*> kLengths[] = {{378.0, "378m"}, {1190.0, "1190m"}, {11000.0, "11km"}};

TerrainScene lanes(Relief relief, const char* relief_name, double length_m, const char* length_name) {
  return {fmt::format("{}_{}", length_name, relief_name), {.relief = relief, .length_m = length_m}};
}

TerrainScene crater_loop() { return {"loop_1030m_highland", {.length_m = 1030.0, .loop = true}}; }

/// The scenes of one relief in which a single value of the nominal one is changed.
class Variations {
 public:
  Variations(const TerrainScene& nominal, std::vector<TerrainScene>& scenes) : nominal_(nominal), scenes_(scenes) {}

  template <class Change>
  void add(const std::string& name, const Change& change) {
    TerrainScene scene = nominal_;
    scene.name += "_" + name;
    change(scene.traverse);
    scenes_.push_back(scene);
  }

 private:
  const TerrainScene& nominal_;
  std::vector<TerrainScene>& scenes_;
};

void add_variations(const TerrainScene& nominal, std::vector<TerrainScene>& scenes) {
  Variations variations(nominal, scenes);
  for (const double cell_m : {2.0, 5.0, 10.0, 20.0})
    variations.add(fmt::format("cell{:g}m", cell_m), [&](TraverseOptions& t) { t.dem.cell_m = cell_m; });
  for (const double rms_m : {1.0, 2.0})
    variations.add(fmt::format("noise{:g}m", rms_m), [&](TraverseOptions& t) { t.dem.noise_rms_m = rms_m; });
  for (const double bias_m : {0.5, 1.0})
    variations.add(fmt::format("bias{:g}m", bias_m), [&](TraverseOptions& t) { t.dem.bias_m = bias_m; });
  for (const double shift_m : {0.5, 1.0, 2.0})
    variations.add(fmt::format("shift{:g}m", shift_m), [&](TraverseOptions& t) { t.dem.shift_m = {shift_m, 0.0}; });
  for (const double start_m : {5.0, 20.0, 50.0}) {
    variations.add(fmt::format("start{:g}m", start_m), [&](TraverseOptions& t) {
      t.start_error_m = start_m;
      t.start_error_deg = 2.0;
    });
  }
}

}  // namespace

std::vector<TerrainScene> terrain_scenes() {
  std::vector<TerrainScene> scenes;
  for (const auto& [length_m, length_name] : kLengths) {
    for (const auto& [relief, relief_name] : kReliefs)
      scenes.push_back(lanes(relief, relief_name, length_m, length_name));
  }
  scenes.insert(scenes.end() - std::ssize(kReliefs), crater_loop());
  return scenes;
}

std::vector<TerrainScene> quick_terrain_scenes() {
  return {lanes(Relief::highland, "highland", 378.0, "378m"), lanes(Relief::mare, "mare", 378.0, "378m"),
          lanes(Relief::highland, "highland", 1190.0, "1190m"), lanes(Relief::mare, "mare", 1190.0, "1190m"),
          crater_loop()};
}

std::vector<TerrainScene> sensitivity_scenes() {
  std::vector<TerrainScene> scenes;
  add_variations(lanes(Relief::highland, "highland", 1190.0, "1190m"), scenes);
  add_variations(lanes(Relief::mare, "mare", 1190.0, "1190m"), scenes);
  return scenes;
}

}  // namespace demslam

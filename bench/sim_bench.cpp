// Simulator: rays per second, a 1024x1024 stereo pair, and what moving on costs. bench/README.md has the table.
#include <benchmark/benchmark.h>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/renderer.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"

namespace demslam {
namespace {

struct Drive {
  explicit Drive(int size_px, double sun_elevation_deg = 30.0)
      : scene(of_size(size_px, sun_elevation_deg)),
        terrain(scene.terrain, scene.seed),
        route(scene.rover),
        rig(stereo_rig(scene.camera)),
        renderer(scene, terrain, route) {}

  static SceneOptions of_size(int size_px, double sun_elevation_deg) {
    SceneOptions scene;
    scene.light.sun_elevation_deg = sun_elevation_deg;
    scene.camera.width_px = scene.camera.height_px = size_px;
    return scene;
  }
  Pose T_map_left(double s_m) const {
    return standing_pose(terrain, scene.rover, route.position(s_m), route.heading(s_m)) * rig.T_body_left;
  }

  SceneOptions scene;
  Terrain terrain;
  Route route;
  StereoRig rig;
  Renderer renderer;
};

void stereo_pair(benchmark::State& state) {
  Drive drive(static_cast<int>(state.range(0)), 0.1 * static_cast<double>(state.range(1)));
  drive.renderer.centre_on({4.0, 0.0});
  const Pose T_map_left = drive.T_map_left(0.0);
  for (auto _ : state) {
    for (const Pose& T : {T_map_left, T_map_left * drive.rig.T_left_right}) {
      const Rendering rendering = drive.renderer.render(drive.rig.left, T);
      benchmark::DoNotOptimize(develop(rendering, drive.scene.camera, 15.0, 1));
    }
  }
  state.counters["pixels/s"] = benchmark::Counter(2.0 * static_cast<double>(state.range(0) * state.range(0)),
                                                  benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(stereo_pair)
    ->ArgNames({"px", "sun_tenths_deg"})
    ->ArgsProduct({{512, 1024}, {300, 150, 50, 15}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

/// The surroundings of the next place, 0.5 m on: mostly nothing to do, sometimes a window of the terrain moves.
void drive_on(benchmark::State& state) {
  Drive drive(1024);
  double x = 0.0;
  for (auto _ : state) drive.renderer.centre_on({x += 0.5, 0.0});
}
BENCHMARK(drive_on)->Iterations(60)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void terrain_height(benchmark::State& state) {
  const Drive drive(512);
  double x = 0.0;
  for (auto _ : state) benchmark::DoNotOptimize(drive.terrain.height(x += 0.01, 3.0));
}
BENCHMARK(terrain_height)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace demslam

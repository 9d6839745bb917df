#include "demslam/sim/simulate.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "commands.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

struct Arguments {
  std::filesystem::path scene, output;
  std::optional<std::filesystem::path> dem;
  std::optional<std::uint64_t> seed;
  std::optional<double> length_m, frame_spacing_m;
  std::optional<int> size_px;
  PictureFiles pictures;
  bool no_depth = false, no_images = false;
};

void set_length(RoverOptions& rover, double length_m) {
  const bool has_length = rover.route == RouteKind::straight || rover.route == RouteKind::loop;
  (has_length ? rover.length_m : rover.stop_after_m) = length_m;
}

SceneOptions scene_of(const Arguments& arguments) {
  SceneOptions scene = arguments.scene.empty() ? SceneOptions{} : read_scene(arguments.scene);
  if (arguments.dem) scene.terrain.dem = std::filesystem::absolute(*arguments.dem);
  if (arguments.seed) scene.seed = *arguments.seed;
  if (arguments.length_m) set_length(scene.rover, *arguments.length_m);
  if (arguments.frame_spacing_m) scene.rover.space_frames(*arguments.frame_spacing_m);
  if (arguments.size_px) scene.camera.width_px = scene.camera.height_px = *arguments.size_px;
  if (arguments.no_depth) scene.output.depth = false;
  if (arguments.no_images) scene.output.images = false;
  check_scene(scene, arguments.scene.empty() ? "scene" : arguments.scene.string());
  return scene;
}

void run(const Arguments& arguments) {
  const SceneOptions scene = scene_of(arguments);
  ProgressBar bar("simulate", "frames");
  const SimulationReport report = simulate(scene, arguments.output, bar.progress(), arguments.pictures);
  if (report.stopped) {
    fmt::print("stopped after {} new frames; the same command goes on from there\n", report.rendered);
    return;
  }
  fmt::print("{}: {} stereo frames over {:.1f} m ", arguments.output.string(), report.frames, report.length_m);
  if (scene.output.images) {
    fmt::print("({} rendered now, {:.0f} ms each)\n", report.rendered, report.render_ms_per_frame);
  } else {
    fmt::print("(rendered when they are read: demslam run {} -o RUN)\n", arguments.output.string());
  }
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "render a stereo traverse with exact truth, its DEM and calibration");
  command->add_option("scene", arguments->scene, "scene TOML (configs/); without one: 150 m over generated highland");
  command->add_option("-o,--output", arguments->output, "dataset folder to write; resumed when it holds the same scene")
      ->required();
  command->add_option("--dem", arguments->dem, "render this terrain (any GDAL raster) instead of the scene's");
  command->add_option("--seed", arguments->seed, "seed of everything random");
  command->add_option("--length-m", arguments->length_m, "driven distance (routes through points end there)");
  command->add_option("--frame-spacing-m", arguments->frame_spacing_m, "distance between frames, by the frame rate")
      ->check(CLI::PositiveNumber);
  command->add_option("--size-px", arguments->size_px, "width and height of the images");
  command->add_flag("--no-depth", arguments->no_depth, "do not write depth images");
  command->add_flag("--no-images", arguments->no_images,
                    "write everything but the frames: 'demslam run' renders them as it reads them");
  command->add_option("--contact-sheet", arguments->pictures.contact_sheet,
                      "also write twelve images and the route over the ground as one picture (PNG or JPEG)");
  command->add_option("--video", arguments->pictures.video, "also write ten seconds of the drive as an animated GIF");
  command->footer("Example:\n  demslam simulate configs/demo.toml -o runs/data --seed 2");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace demslam::apps

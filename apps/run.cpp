#include "demslam/slam/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "dem_findings.h"
#include "demslam/config/slam_config.h"
#include "demslam/features/frontend_names.h"
#include "demslam/geometry/angle.h"
#include "demslam/report/live_server.h"
#include "demslam/sim/rendered_sequence.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

struct Arguments {
  RunInputs inputs;
  std::filesystem::path config;
  std::string extractor, matcher, inference, odometry;
  bool no_dem = false, no_loops = false, odometry_only = false;
  std::optional<int> live_port;
};

/// A name that is known, or else a file.
void set_part(std::string& name, std::filesystem::path& model, const std::string& wanted,
              const std::vector<std::string>& names) {
  if (wanted.empty()) return;
  const bool is_name = wanted != "onnx" && std::ranges::find(names, wanted) != names.end();
  name = is_name ? wanted : "onnx";
  model = is_name ? "" : wanted;
}

SlamOptions options_of(const Arguments& arguments) {
  SlamOptions options = arguments.config.empty() ? SlamOptions{} : read_slam_config(arguments.config);
  if (arguments.no_dem || arguments.odometry_only) options.use_dem = false;
  if (arguments.no_loops || arguments.odometry_only) options.use_loops = false;
  if (!arguments.odometry.empty()) options.odometry.method = *odometry_method(arguments.odometry);
  FrontendOptions& frontend = options.frontend;
  set_part(frontend.extractor, frontend.extractor_model, arguments.extractor, extractor_names());
  set_part(frontend.matcher, frontend.matcher_model, arguments.matcher, matcher_names());
  if (!arguments.inference.empty()) frontend.inference = arguments.inference;
  frontend = resolved(frontend);
  return options;
}

/// A dataset on the disk, or one whose images are rendered as they are read.
std::unique_ptr<StereoSequence> open_input(const std::filesystem::path& path, const std::string& format,
                                           const std::filesystem::path& calibration) {
  if (format.empty() && is_rendered_dataset(path)) return open_rendered_dataset(path, calibration);
  return open_dataset(path, format, calibration);
}

/// Where the rig is not as its calibration says; to three sigmas.
void print_vergence(const std::optional<Vergence>& found, const OdometryOptions& options) {
  if (!found && options.self_calibration.enabled && options.method == OdometryMethod::window) {
    fmt::print("  the disparities do not fit the calibration, which is used as it is (demslam dataset check)\n");
  }
  if (!found || std::abs(found->rad) < 3.0 * found->sigma_rad()) return;
  fmt::print(
      "  disparities are off as if the right camera had turned by {:+.4f} +- {:.4f} degrees since the calibration\n",
      found->rad / kRadPerDeg, found->sigma_rad() / kRadPerDeg);
}

void print(const RunInputs& inputs, const RunReport& report, const SlamOptions& options) {
  const SlamCounters& counters = report.result.counters;
  fmt::print("{}: {} of {} frames tracked, {} keyframes, {} loops closed, {}\n", inputs.output.string(),
             counters.tracked, report.frames_asked, counters.keyframes, counters.loops.accepted,
             report.anchored ? fmt::format("{} DEM factors", counters.anchoring.height + counters.anchoring.normal)
                             : std::string("no DEM"));
  if (counters.frames > 0) {
    fmt::print("  {:.1f} m in {:.1f} s ({:.0f} ms per frame)\n", path_length_m(report.result.trajectory),
               report.seconds, 1e3 * report.seconds / static_cast<double>(counters.frames));
  }
  print_dem_findings(report.result);
  print_vergence(report.vergence, options.odometry);
  if (!counters.anchoring.start_search.empty()) fmt::print("  start: {}\n", counters.anchoring.start_search);
  if (report.resumed_at > inputs.first_frame) fmt::print("  resumed at frame {}\n", report.resumed_at);
  if (report.interrupted) fmt::print("  interrupted: the folder holds what was done; the same command goes on\n");
}

/// The page of this run while it goes on, where one is asked for.
std::unique_ptr<LiveServer> serve(const Arguments& arguments) {
  if (!arguments.live_port) return nullptr;
  auto server = std::make_unique<LiveServer>(arguments.inputs.output, *arguments.live_port);
  fmt::print(stderr, "live: http://127.0.0.1:{}/\n", server->port());
  return server;
}

void run(Arguments arguments) {
  const SlamOptions options = options_of(arguments);
  arguments.inputs.config_toml = to_toml(options);
  arguments.inputs.open = open_input;
  const auto live = serve(arguments);
  ProgressBar bar("run", "frames");
  const RunReport report = run_slam(arguments.inputs, options, bar.progress());
  if (live) live->finish();
  print(arguments.inputs, report, options);
}

}  // namespace

void add_run(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  RunInputs& inputs = arguments->inputs;
  CLI::App* command = app.add_subcommand("run", "stereo SLAM over a dataset, anchored to a DEM");
  command->add_option("dataset", inputs.dataset, "folder with stereo images (demslam, kitti, euroc, folders, ...)")
      ->required();
  command->add_option("-o,--output", inputs.output, "run folder to write")->required();
  command->add_option("--dem", inputs.dem, "elevation model; default: the dataset's own dem.tif, if it has one");
  command->add_option("--dem-sigma", inputs.dem_sigma,
                      "raster of the DEM's standard error in metres; default: dem_sigma.tif beside dem.tif");
  command->add_option("-c,--config", arguments->config, "options TOML; a run folder's config.toml repeats that run");
  command->add_option("--start", inputs.start,
                      "TOML with T_map_body of the first frame; default: the dataset's start.toml");
  command->add_option("--map", inputs.map,
                      "run folder or map.db of an earlier run in the same map frame, to localise in");
  command->add_option("--unknown-start", inputs.unknown_start_radius_m,
                      "search for the start within so many metres of --start, or of the DEM's middle");
  command->add_option("--heading-deg", inputs.heading_deg, "with --unknown-start: heading of the first frame");
  command->add_option("--format", inputs.format, "dataset format, when it is not recognised");
  command->add_option("--calibration", inputs.calibration, "calibration TOML, replaces the dataset's own");
  command->add_option("--extractor", arguments->extractor,
                      "classical (default), lunar (a network, built in), orb, sift, or an ONNX file (docs/models.md)");
  command->add_option("--matcher", arguments->matcher,
                      "nearest (default), lunar (a network, built in, for --extractor lunar), or an ONNX file");
  command
      ->add_option("--inference", arguments->inference,
                   "who runs networks: auto (default), onnxruntime, or onednn (docs/models.md)")
      ->check(CLI::IsMember(inference_names()));
  command->add_option("--first-frame", inputs.first_frame, "index of the first frame");
  command->add_option("--max-frames", inputs.max_frames, "stop after so many frames; 0: all");
  command
      ->add_option(
          "--odometry", arguments->odometry,
          "window (bundle adjustment over keyframes), keyframe (each frame from the last keyframe, by patches) or pnp "
          "(each frame from the one before, as published)")
      ->check(CLI::IsMember({"window", "keyframe", "pnp"}));
  command->add_flag("--no-dem", arguments->no_dem, "do not use the DEM");
  command->add_flag("--no-loops", arguments->no_loops, "do not close loops");
  command->add_flag("--odometry-only", arguments->odometry_only, "neither DEM nor loops");
  command
      ->add_option("--live", arguments->live_port,
                   "serve the report page on this machine while the run goes on; port, default 8470, 0: any free one")
      ->expected(0, 1)
      ->default_str("8470");
  command->add_flag("--overwrite", inputs.overwrite, "start anew in the output folder, whatever it holds");
  command->footer(
      "Examples:\n  demslam run runs/data -o runs/anchored\n  demslam run runs/data -o runs/odometry --odometry-only\n"
      "  demslam run runs/second -o runs/localised --map runs/anchored\n"
      "An interrupted or killed run goes on at its last keyframe when its command is given again.");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace demslam::apps

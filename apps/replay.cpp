#include "demslam/slam/replay.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands.h"
#include "dem_findings.h"
#include "demslam/config/slam_config.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

struct Arguments {
  ReplayInputs inputs;
  std::filesystem::path config;
  bool no_dem = false, no_loops = false;
};

void run(Arguments arguments) {
  SlamOptions options = arguments.config.empty() ? SlamOptions{} : read_slam_config(arguments.config);
  if (arguments.no_dem) options.use_dem = false;
  if (arguments.no_loops) options.use_loops = false;
  options.frontend = resolved(options.frontend);
  arguments.inputs.config_toml = to_toml(options);
  ProgressBar bar("replay", "keyframes");
  const RunReport report = replay(arguments.inputs, options, bar.progress());
  fmt::print("{}: {} keyframes solved again in {:.1f} s\n", arguments.inputs.output.string(),
             report.result.counters.keyframes, report.seconds);
  print_dem_findings(report.result);
}

}  // namespace

void add_replay(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  ReplayInputs& inputs = arguments->inputs;
  CLI::App* command =
      app.add_subcommand("replay", "solve a recorded run again with other options or another DEM, without its images");
  command->add_option("run", inputs.run, "run folder with its map.db")->required();
  command->add_option("-o,--output", inputs.output, "run folder to write")->required();
  command->add_option("--dem", inputs.dem, "elevation model; default: the recorded run's or its dataset's");
  command->add_option("--start", inputs.start, "TOML with T_map_body of the first frame; default: the dataset's");
  command->add_option("-c,--config", arguments->config, "options TOML; front-end and odometry stay as recorded");
  command->add_flag("--no-dem", arguments->no_dem, "do not use a DEM");
  command->add_flag("--no-loops", arguments->no_loops, "do not close loops");
  command->add_flag("--overwrite", inputs.overwrite, "replace a finished run in the output folder");
  command->footer("Example:\n  demslam replay runs/odometry --dem other.tif -o runs/other");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace demslam::apps

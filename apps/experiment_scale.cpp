#include "demslam/experiment/scale_experiment.h"

#include <filesystem>
#include <memory>

#include "experiments.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output;
  bool quick = false, no_map = false;
  ScaleExperiment experiment;
};

void run(Arguments a) {
  if (a.quick) {
    a.experiment.lengths_km = {0.3, 1.0};
    a.experiment.drive.world_m = 2000.0;
  }
  const FinishedRuns finished(a.output);
  if (!a.no_map) a.experiment.map_folder = a.output;
  ProgressBar bar("scale", "keyframes");
  const std::vector<ScaleRow> rows = scale_experiment(a.experiment, &finished, bar.progress());
  write_experiment(a.output, "scale", scale_table(rows), scale_json(rows));
}

}  // namespace

void add_scale_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand(
      "scale", "cost, memory, map and error of the back-end over kilometres, without images");
  command->add_option("-o,--output", a->output, "folder for tables and finished runs; goes on where it stopped")
      ->required();
  command->add_option("--length-km", a->experiment.lengths_km, "lengths of the drives")->check(CLI::PositiveNumber);
  command->add_option("--seeds", a->experiment.seeds, "drives of each length")->check(CLI::PositiveNumber);
  command->add_option("--features", a->experiment.features_per_keyframe, "in the map, 64 bytes of descriptor each")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--no-map", a->no_map, "write no map while driving");
  command->add_flag("--quick", a->quick, "300 m and 1 km on a small DEM");
  command->footer("Example:\n  demslam experiment scale --quick -o runs/scale");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

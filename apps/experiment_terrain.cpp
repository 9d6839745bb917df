#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/experiment/terrain_experiment.h"
#include "experiments.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output;
  bool quick = false, sensitivity = false;
  int seeds = 0;  ///< 0: ten, or three with --quick
  std::vector<std::string> scenes, estimators;
  TerrainExperiment experiment;
};

std::vector<TerrainScene> scenes_of(const Arguments& a) {
  if (a.sensitivity) return sensitivity_scenes();
  return a.quick ? quick_terrain_scenes() : terrain_scenes();
}

void run(Arguments a) {
  a.experiment.scenes = scenes_of(a);
  keep(a.experiment.scenes, a.scenes, "scene");
  keep(a.experiment.estimators, a.estimators, "estimator");
  a.experiment.seeds = a.seeds > 0 ? a.seeds : (a.quick ? 3 : 10);
  const SeedStore store(a.output);
  ProgressBar bar("terrain", "worlds");
  const std::vector<ExperimentRow> rows = terrain_experiment(a.experiment, &store, bar.progress());
  write_text(a.output / "terrain.md", experiment_markdown(rows));
  write_text(a.output / "terrain.csv", csv_table(experiment_table(rows)));
  write_text(a.output / "terrain.json", experiment_json(rows));
  write_text(a.output / "timings.csv", csv_table(timing_table(rows)));
  fmt::print("{}", text_table(experiment_table(rows)));
}

}  // namespace

void add_terrain_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand(
      "terrain", "position from terrain without images: estimators, reliefs, lengths, seeds");
  command->add_option("-o,--output", a->output, "folder for tables and finished seeds; goes on where it stopped")
      ->required();
  command->add_flag("--quick", a->quick, "five short scenes, three seeds");
  command->add_flag("--sensitivity", a->sensitivity, "DEM cells, noise, bias, shift and a wrong start instead");
  command->add_option("--seeds", a->seeds, "worlds per scene")->check(CLI::PositiveNumber);
  command->add_option("--first-seed", a->experiment.first_seed, "seed of the first world");
  command->add_option("--threads", a->experiment.threads, "seeds at the same time")->check(CLI::PositiveNumber);
  command->add_option("--scene", a->scenes, "these scenes only, by name");
  command->add_option("--estimator", a->estimators, "these estimators only, by name");
  command->footer("Example:\n  demslam experiment terrain --quick -o runs/terrain");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

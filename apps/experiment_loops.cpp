#include <filesystem>
#include <memory>

#include "demslam/experiment/loops_experiment.h"
#include "experiments.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output;
  int seeds = 0, false_loops = -1;  ///< 0 and less: as --quick says
  bool quick = false;
  LoopsExperiment experiment;
};

void run(Arguments a) {
  if (a.quick) {
    a.experiment.laps = 3;
    a.experiment.seeds = 2;
    a.experiment.false_loops = 300;
  }
  if (a.seeds > 0) a.experiment.seeds = a.seeds;
  if (a.false_loops >= 0) a.experiment.false_loops = a.false_loops;
  const FinishedRuns finished(a.output);
  ProgressBar bar("loops", "runs");
  const std::vector<LoopsRun> runs = loops_experiment(a.experiment, &finished, bar.progress());
  write_experiment(a.output, "loops", loops_table(runs), loops_json(runs));
}

}  // namespace

void add_loops_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand("loops", "false loop closures put into runs that have true ones too");
  command->add_option("-o,--output", a->output, "folder for tables and finished runs; goes on where it stopped")
      ->required();
  command->add_option("--seeds", a->seeds, "runs, with and without absolute fixes")->check(CLI::PositiveNumber);
  command->add_option("--false-loops", a->false_loops, "in each run")->check(CLI::NonNegativeNumber);
  command->add_flag("--quick", a->quick, "two shorter runs of each kind, 300 false loops");
  command->footer("Example:\n  demslam experiment loops --quick -o runs/loops");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

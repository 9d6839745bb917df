#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/markdown.h"
#include "demslam/experiment/frontend_experiment.h"
#include "experiments.h"
#include "frontend_choice.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output;
  FrontendChoice choice;
  int seeds = 0, size_px = 0;  ///< 0: as --quick says
  bool quick = false;
  FrontendExperiment experiment;
};

void run(Arguments a) {
  std::error_code failure;
  fs::create_directories(a.output, failure);
  if (failure) throw Error(a.output.string() + ": cannot be made: " + failure.message());
  a.experiment.frontends = a.choice.frontends();
  a.experiment.simulated.seeds = a.seeds > 0 ? a.seeds : (a.quick ? 1 : 8);
  a.experiment.simulated.size_px = a.size_px > 0 ? a.size_px : (a.quick ? 320 : 512);
  if (a.quick) a.experiment.real_pairs = 3;
  if (!a.choice.has_xfeat())
    fmt::print(stderr, "rows with XFeat are left out: --xfeat names no file (docs/models.md)\n");
  ProgressBar bar("frontend", "places");
  const std::vector<FrontendRow> rows = frontend_experiment(a.experiment, bar.progress());
  const Table table = frontend_table(rows);
  write_text(a.output / "frontend.md", table.title + "\n\n" + markdown_table(table));
  write_text(a.output / "frontend.csv", csv_table(table));
  write_text(a.output / "frontend.json", frontend_json(rows));
  fmt::print("{}", text_table(table));
}

}  // namespace

void add_frontend_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand(
      "frontend", "matches and motions of every front-end: simulated drives, changed sun, real pairs");
  command->add_option("-o,--output", a->output, "folder for the tables")->required();
  command->add_flag("--quick", a->quick, "three small places: a table in a minute");
  command->add_option("--seeds", a->seeds, "worlds per relief")->check(CLI::PositiveNumber);
  command->add_option("--first-seed", a->experiment.simulated.first_seed, "seed of the first world");
  command->add_option("--size-px", a->size_px, "width and height of simulated images")->check(CLI::PositiveNumber);
  a->choice.add_options(*command);
  command->add_option("--data", a->experiment.data, "folder with kitti_seq1, euroc_v101_short, rover_sandbox")
      ->check(CLI::ExistingDirectory);
  command->add_option("--calibration", a->experiment.calibration, "of rover_sandbox (configs/rover_sandbox.toml)")
      ->default_val("configs/rover_sandbox.toml");
  command->footer("Example:\n  demslam experiment frontend --quick -o runs/frontend");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/experiment/fix_experiment.h"
#include "experiments.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output;
  int seeds = 0;  ///< 0: as --quick says
  bool quick = false;
  FixExperiment experiment;
};

void run(Arguments a) {
  if (a.quick) a.experiment.seeds = 1;
  if (a.seeds > 0) a.experiment.seeds = a.seeds;
  std::error_code failure;
  fs::create_directories(a.output, failure);
  if (failure) throw Error(a.output.string() + ": cannot be made: " + failure.message());
  ProgressBar bar("fixes", "worlds");
  const Table table = fix_table(fix_experiment(a.experiment, bar.progress()));
  write_text(a.output / "fixes.csv", csv_table(table));
  fmt::print("{}", text_table(table));
}

}  // namespace

void add_fixes_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand(
      "fixes", "how often a search for a submap finds the place, and how often a wrong one, without images");
  command->add_option("-o,--output", a->output, "folder for the table")->required();
  command->add_option("--seeds", a->seeds, "worlds per relief")->check(CLI::PositiveNumber);
  command->add_option("--first-seed", a->experiment.first_seed, "seed of the first world");
  command->add_option("--start-error-m", a->experiment.start_errors_m, "how far off the search begins");
  command->add_option("--anywhere-m", a->experiment.global_radius_m, "also search this radius without a start");
  command->add_flag("--foreign", a->experiment.foreign, "on the map of another world: whatever is accepted is wrong");
  command->add_option("--dem-noise-m", a->experiment.traverse.dem.noise_rms_m, "of the DEM");
  command->add_option("--stated-noise-m", a->experiment.dem_error.sigma_m, "what the search is told of it");
  command->add_option("--submap-m", a->experiment.submap.length_m, "path per submap")->check(CLI::PositiveNumber);
  command->add_option("--length-m", a->experiment.traverse.length_m, "of each drive")->check(CLI::PositiveNumber);
  command->add_option("--threads", a->experiment.threads, "worlds at the same time")->check(CLI::PositiveNumber);
  command->add_flag("--quick", a->quick, "one world per relief");
  command->footer("Example:\n  demslam experiment fixes --seeds 3 -o runs/fixes");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

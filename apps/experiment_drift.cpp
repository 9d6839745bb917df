#include <filesystem>
#include <memory>

#include "demslam/experiment/drift_experiment.h"
#include "demslam/experiment/published.h"
#include "experiments.h"
#include "frontend_choice.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output, configs;
  FrontendChoice choice;
  ExperimentExtent extent;
  DriftExperiment experiment;
};

void run(Arguments a) {
  a.experiment.frontends = a.choice.frontends();
  a.experiment.drives = short_drives(scene_presets(a.configs), a.extent);
  a.experiment.seeds = seeds_of(a.extent);
  ProgressBar bar("drift", "frames");
  const std::vector<DriftRow> rows = drift_experiment(a.experiment, a.output, bar.progress());
  write_experiment(a.output, "drift", drift_table(rows), drift_json(rows));
}

}  // namespace

void add_drift_experiment(CLI::App& experiments) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand("drift",
                                                 "odometry alone, frame to frame, by keyframes and by a window, with "
                                                 "every front-end: three drives of 300 m, real sequences");
  command->add_option("-o,--output", a->output, "folder for runs and tables; goes on where it stopped")->required();
  command->add_flag("--quick", a->extent.quick, "40 m of small images per drive");
  command->add_option("--seeds", a->extent.seeds, "worlds per drive")->check(CLI::PositiveNumber);
  command->add_option("--frame-spacing-m", a->extent.frame_spacing_m, "distance between frames; default: the preset's");
  command->add_option("--size-px", a->extent.size_px, "width and height of the images; default: the preset's");
  a->choice.add_options(*command);
  command->add_option("--sequence", a->experiment.sequences, "a real sequence with its truth; may be repeated")
      ->check(CLI::ExistingDirectory);
  command->add_option("--configs", a->configs, "folder of the scene presets");
  command->footer("Example:\n  demslam experiment drift --quick -o runs/drift");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <memory>

#include "demslam/experiment/published.h"
#include "demslam/experiment/study_figures.h"
#include "demslam/experiment/study_table.h"
#include "experiments.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path output, configs, nac;
  ExperimentExtent extent;
  bool keep_recordings = false;
};

using MakeExperiment = std::function<PublishedExperiment(const Arguments&, const fs::path& configs)>;

void run(const Arguments& arguments, const MakeExperiment& make) {
  PublishedExperiment experiment = make(arguments, scene_presets(arguments.configs));
  experiment.study.keep_recordings = arguments.keep_recordings;
  ProgressBar bar(experiment.study.name, "frames");
  const auto scores = run_study(experiment.study, arguments.output, bar.progress());
  write_study(experiment.study, scores, experiment.published, arguments.output);
  write_study_figures(experiment.study, arguments.output);
  fmt::print("{}", study_markdown(experiment.study, scores, experiment.published));
}

CLI::App* add(CLI::App& experiments, const char* name, const char* what, const MakeExperiment& make) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = experiments.add_subcommand(name, what);
  command->add_option("-o,--output", arguments->output, "folder for runs and tables; goes on where it stopped")
      ->required();
  command->add_option("--seeds", arguments->extent.seeds, "worlds per scene")->check(CLI::PositiveNumber);
  command->add_option("--first-seed", arguments->extent.first_seed, "of the worlds; a cluster can share them out")
      ->check(CLI::PositiveNumber);
  command->add_option("--frame-spacing-m", arguments->extent.frame_spacing_m,
                      "distance between frames; default: the preset's");
  command->add_option("--size-px", arguments->extent.size_px, "width and height of the images; default: the preset's");
  command->add_flag("--quick", arguments->extent.quick, "40 m of small images per scene: a table in minutes");
  command->add_flag("--keep-recordings", arguments->keep_recordings,
                    "keep what was tracked: a variant whose folder is removed is solved again without its images");
  command->add_option("--configs", arguments->configs, "folder of the scene presets");
  command->add_option("--nac", arguments->nac, "a real elevation map for one more scene (anchoring)")
      ->check(CLI::ExistingFile);
  command->footer(fmt::format("Example:\n  demslam experiment {} --quick -o runs/{}", name, name));
  command->callback([=] { run(*arguments, make); });
  return command;
}

}  // namespace

void add_published_experiments(CLI::App& experiments) {
  add(experiments, "lusnar", "table 1: nine LuSNAR-like scenes",
      [](const Arguments& a, const fs::path& configs) { return lusnar_experiment(configs, a.extent); });
  add(experiments, "crater", "a loop of 1.03 km around a crater rim, with and without loop closure and DEM",
      [](const Arguments& a, const fs::path& configs) { return crater_experiment(configs, a.extent); });
  add(experiments, "traverse", "1.19 km: odometry, published factors, everything",
      [](const Arguments& a, const fs::path& configs) { return traverse_experiment(configs, a.extent); });
  add(experiments, "longrange", "11 km: odometry, with a sun sensor, with the DEM, with both",
      [](const Arguments& a, const fs::path& configs) { return longrange_experiment(configs, a.extent); });
  add(experiments, "uncertainty", "table 2: 378 m with noise, bias and shift of the DEM",
      [](const Arguments& a, const fs::path& configs) { return uncertainty_experiment(configs, a.extent); });
  add(experiments, "anchoring", "every kind of anchoring with images: highland, crater rim, mare, a real map",
      [](const Arguments& a, const fs::path& configs) { return anchoring_experiment(configs, a.extent, a.nac); });
}

}  // namespace demslam::apps

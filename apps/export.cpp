#include "demslam/evaluation/export.h"

#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "truth_options.h"

namespace demslam::apps {

void add_results_export(CLI::App& app) {
  auto inputs = std::make_shared<ExportInputs>();
  CLI::App* command = app.add_subcommand("export", "a result as TUM, KITTI, EuRoC, GeoJSON, KML; its error as GeoTIFF");
  command->add_option("run", inputs->run_or_trajectory, "run folder or trajectory file")->required();
  command->add_option("-o,--output", inputs->output, "folder to write")->required();
  command->add_option("--truth", inputs->truth, "true trajectory; default: the one of the run's dataset");
  command->add_option("--max-difference-s", inputs->max_difference_s, "stamps further apart do not pair");
  add_geodetic_options(*command, inputs->options);
  add_clock_offset(*command, inputs->options);
  command->footer("Example:\n  demslam export runs/anchored -o runs/anchored/export");
  command->callback([inputs] {
    for (const auto& file : export_run(*inputs)) fmt::print("{}: written\n", file.string());
  });
}

}  // namespace demslam::apps

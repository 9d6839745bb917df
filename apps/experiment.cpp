#include "experiments.h"

#include "commands.h"

namespace demslam::apps {

void add_experiment(CLI::App& app) {
  CLI::App* experiments = app.add_subcommand("experiment", "one published table each, end to end");
  experiments->require_subcommand(1);
  add_terrain_experiment(*experiments);
  add_published_experiments(*experiments);
  add_fixes_experiment(*experiments);
  add_loops_experiment(*experiments);
  add_scale_experiment(*experiments);
  add_frontend_experiment(*experiments);
}

}  // namespace demslam::apps

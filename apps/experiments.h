#pragma once

#include <CLI/CLI.hpp>

namespace demslam::apps {

// Each adds one experiment below `demslam experiment`, in a file experiment_NAME.cpp; experiment.cpp lists them.
void add_terrain_experiment(CLI::App& experiments);
void add_fixes_experiment(CLI::App& experiments);

}  // namespace demslam::apps

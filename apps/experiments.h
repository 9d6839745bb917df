#pragma once

#include <CLI/CLI.hpp>

namespace demslam::apps {

// Each adds one experiment below `demslam experiment`, in a file experiment_NAME.cpp; experiment.cpp lists them.
void add_terrain_experiment(CLI::App& experiments);
void add_fixes_experiment(CLI::App& experiments);
void add_loops_experiment(CLI::App& experiments);
void add_scale_experiment(CLI::App& experiments);
void add_frontend_experiment(CLI::App& experiments);
/// lusnar, crater, traverse, uncertainty and anchoring share one file: they differ in their scenes alone.
void add_published_experiments(CLI::App& experiments);

}  // namespace demslam::apps

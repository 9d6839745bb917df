#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "demslam/evaluation/table.h"

namespace demslam::apps {

// Each adds one experiment below `demslam experiment`, in a file experiment_NAME.cpp; experiment.cpp lists them.
void add_terrain_experiment(CLI::App& experiments);
void add_fixes_experiment(CLI::App& experiments);
void add_loops_experiment(CLI::App& experiments);
void add_scale_experiment(CLI::App& experiments);
void add_frontend_experiment(CLI::App& experiments);
void add_drift_experiment(CLI::App& experiments);
/// lusnar, crater, traverse, uncertainty and anchoring share one file: they differ in their scenes alone.
void add_published_experiments(CLI::App& experiments);

/// The presets beside the program, in the source tree or installed, unless a folder is asked for. Throws Error.
std::filesystem::path scene_presets(const std::filesystem::path& asked);

/// NAME.md, NAME.csv and NAME.json in a folder, and the table on the terminal. Throws Error.
void write_experiment(const std::filesystem::path& folder, const std::string& name, const Table& table,
                      const std::string& json);

}  // namespace demslam::apps

#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "demslam/base/error.h"
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

/// Keeps those whose names are asked for, all when none is. Throws Error, with the names there are, for one that is not
/// there.
template <class Named>
void keep(std::vector<Named>& all, const std::vector<std::string>& names, const char* what) {
  if (names.empty()) return;
  std::string known;
  for (const Named& one : all) known += (known.empty() ? "" : ", ") + one.name;
  for (const std::string& name : names) {
    if (std::ranges::find(all, name, &Named::name) != all.end()) continue;
    throw Error("no " + std::string(what) + " \"" + name + "\"; there are: " + known);
  }
  std::erase_if(all, [&](const Named& one) { return std::ranges::find(names, one.name) == names.end(); });
}

/// NAME.md, NAME.csv and NAME.json in a folder, and the table on the terminal. Throws Error.
void write_experiment(const std::filesystem::path& folder, const std::string& name, const Table& table,
                      const std::string& json);

}  // namespace demslam::apps

#pragma once

#include <CLI/CLI.hpp>
#include <stop_token>

namespace demslam::apps {

// Each adds one sub-command: it parses, calls one function of the library, prints.
void add_simulate(CLI::App& app);
void add_run(CLI::App& app);
void add_replay(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_dataset(CLI::App& app);
void add_dem(CLI::App& app);
void add_dem_observability(CLI::App& dem);
void add_experiment(CLI::App& app);
void add_results_export(CLI::App& app);
void add_map(CLI::App& app);
void add_report(CLI::App& app);
void add_models(CLI::App& app);

/// Set by Ctrl-C and SIGTERM; long work is handed its token and leaves valid results behind.
std::stop_source& interrupt();

}  // namespace demslam::apps

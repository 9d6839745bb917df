#pragma once

#include <CLI/CLI.hpp>

#include "demslam/evaluation/truth.h"

namespace demslam::apps {

/// Options of every command that takes a truth in longitude and latitude: --dem, --dem-heights, --geoid-undulation-m,
/// --worst-quality.
void add_geodetic_options(CLI::App& command, TruthOptions& options);

/// --clock-offset-s SECONDS or `auto`.
void add_clock_offset(CLI::App& command, TruthOptions& options);

/// Turns "geoid" and its like into the datum.
CLI::Option* add_datum_option(CLI::App& command, const std::string& name, std::optional<HeightDatum>& datum,
                              const std::string& description);

}  // namespace demslam::apps

#pragma once

#include <filesystem>
#include <string>

#include "demslam/slam/options.h"

namespace demslam {

/// Options from a TOML file; what the file does not say keeps its default. Throws Error with file and line for an
/// unknown key (and names the nearest known one), a wrong type or a value that makes no sense.
SlamOptions read_slam_config(const std::filesystem::path& file);

/// Every option with its present value; read_slam_config() reads it back.
std::string to_toml(const SlamOptions& options);

}  // namespace demslam

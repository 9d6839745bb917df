#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace demslam {

struct MapReport {
  std::size_t keyframes = 0, frames = 0, factors = 0;
  std::vector<std::string> problems;  ///< a line each; empty: the map is sound
};

/// Reads a whole map: the file's own structure, that everything refers to something, that poses and covariances are
/// finite, that every keyframe has its features. Throws Error when it cannot be opened as a map; changes nothing.
MapReport check_map(const std::filesystem::path& file);

}  // namespace demslam

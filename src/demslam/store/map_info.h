#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace demslam {

/// A map in figures.
struct MapInfo {
  int schema = 0;
  std::string version;  ///< of the demslam that made it
  std::size_t keyframes = 0, frames = 0, odometry_factors = 0;
  std::size_t loops = 0, loops_accepted = 0;
  std::size_t features = 0, landmarks = 0;  ///< landmarks: features with a disparity
  int descriptor_width = 0;
  double length_m = 0.0;  ///< path over the keyframes' newest estimates
  double duration_s = 0.0;
  std::int64_t file_bytes = 0;

  /// 0 for a map without length.
  double bytes_per_km() const { return length_m > 0.0 ? static_cast<double>(file_bytes) * 1e3 / length_m : 0.0; }
};

/// Throws Error when the file is no sound map.
MapInfo map_info(const std::filesystem::path& file);

}  // namespace demslam

#pragma once

#include <filesystem>
#include <vector>

namespace demslam {

/// Writes a map for other programs into a folder, which is made where it is missing, and returns the files:
///   keyframes.tum   T_map_body, newest estimates, seconds
///   factors.csv     relative poses, body to body, with status and covariance
///   landmarks.ply   points in the map frame, metres: keypoints with a disparity, seen from the newest estimates
/// One keyframe is in memory at a time. Throws Error.
std::vector<std::filesystem::path> export_map(const std::filesystem::path& map, const std::filesystem::path& folder);

}  // namespace demslam

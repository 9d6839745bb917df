#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace demslam {

/// Points of a cloud file: PLY (ascii or binary_little_endian; its vertices' x, y, z), or a table whose first three
/// columns are x, y, z. Throws Error when the file is truncated or of another kind.
std::vector<Eigen::Vector3d> read_point_cloud(const std::filesystem::path& file);

}  // namespace demslam

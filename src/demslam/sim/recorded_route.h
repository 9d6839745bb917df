#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace demslam {

/// The places of a TUM trajectory (seconds x y z qx qy qz qw, map frame), thinned out to at least a metre apart: the
/// way that a real or simulated rover drove. Throws Error with file and line.
std::vector<Eigen::Vector2d> recorded_places(const std::filesystem::path& file);

}  // namespace demslam

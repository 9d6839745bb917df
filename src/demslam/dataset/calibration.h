#pragma once

#include <filesystem>
#include <string>

#include "demslam/geometry/camera.h"

namespace demslam {

/// demslam calibration TOML:
///   [left]  width, height, fx, fy, cx, cy (px); distortion = "none" | "radtan" | "equidistant"; coefficients = [..]
///   [right] the same; may be left out when equal to [left]
///   baseline_m = 0.31  or  T_left_right = [16 numbers, row-major]
///   row_offset_px = 3.2   optional: y_right = y_left + row_offset_px, becomes part of the right camera's cy
///   [body]  T_body_left = [16 numbers], p_body_ground_m = [x, y, z]; default: body axes at the left camera's centre
/// Throws Error with file and line; check_rig() has been passed by what is returned.
StereoRig read_calibration_toml(const std::filesystem::path& file);
std::string calibration_toml(const StereoRig& rig);

}  // namespace demslam

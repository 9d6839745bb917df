#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "demslam/geometry/camera.h"

namespace demslam {

/// A calibration file's content; its rig has passed check_rig().
struct Calibration {
  StereoRig rig;
  std::optional<double> frame_rate_hz;  ///< for datasets whose images carry no stamps
};

/// demslam calibration TOML:
///   frame_rate_hz = 1.0   optional
///   baseline_m = 0.31  or  T_left_right = [16 numbers, row-major]
///   row_offset_px = 3.2   optional: y_right = y_left + row_offset_px, becomes part of the right camera's cy
///   [left]  width, height, fx, fy, cx, cy (px); distortion = "none" | "radtan" | "equidistant"; coefficients = [..]
///   [right] the same; may be left out when equal to [left]
///   [body]  T_body_left = [16 numbers], p_body_ground_m = [x, y, z]; default: body axes at the left camera's centre
/// A .yaml file is one of Kalibr, ORB-SLAM3 or stella_vslam (calibration_import.h). Throws Error with file and line.
Calibration read_calibration(const std::filesystem::path& file);
StereoRig read_calibration_toml(const std::filesystem::path& file);
std::string calibration_toml(const StereoRig& rig);

/// The body that a camera of unknown mounting gets: at its centre, forward, left and up as a level camera sees them.
Pose level_T_body_left();

}  // namespace demslam

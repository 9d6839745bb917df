#pragma once

#include <filesystem>

#include "demslam/dataset/calibration.h"
#include "demslam/dataset/yaml.h"

namespace demslam {

/// Calibrations of other programs, recognised by their keys:
///   Kalibr camchain (cam0, cam1), ORB-SLAM3 (Camera1.fx, or the older Camera.fx with Camera.bf, and LEFT.K where the
///   images are not rectified), stella_vslam (Camera: fx, focal_x_baseline; StereoRectifier where not rectified).
/// The body is the IMU where the file has one, else a level one at the left camera. Throws Error with file and line.
Calibration import_calibration(const std::filesystem::path& yaml_file);

/// A camera as lists: `resolution`, `intrinsics`, `distortion_model` and the list `coefficients_key` (EuRoC, Kalibr).
Camera read_listed_camera(const Yaml& yaml, const std::string& coefficients_key);

}  // namespace demslam

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/dataset/sequence.h"

namespace demslam {

/// What a conversion wrote.
struct ConvertedDataset {
  std::size_t pairs = 0;
  /// The frame that the new dataset calls its body: what a truth T_map_body must be multiplied with from the right.
  Pose T_body_newbody;
};

/// Writes a sequence in another format into `output` (a new or empty folder; for "rosbag" a file that does not exist):
///   demslam  raw images, calibration.toml, start.toml and DEM where there are any
///   euroc    raw images, sensor.yaml with T_BS in our body
///   kitti    rectified images, calib.txt, times.txt; the body becomes the rectified left camera, as in KITTI's poses
///   rosbag   ROS 1 bag, lz4: S3LI's topics of rectified images with camera_info; the body becomes a level one at the
///            left camera
/// Truth is not its concern. Throws Error when the format is unknown or the output exists or cannot be written.
ConvertedDataset convert_dataset(const StereoSequence& sequence, const std::string& format,
                                 const std::filesystem::path& output, const Progress& progress);

/// The formats that can be written.
std::vector<std::string> writable_formats();

}  // namespace demslam

#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/report/columns.h"

namespace demslam {

/// One attempt to close a loop.
struct LoopLine {
  std::string status, reason;
  int inliers = 0;
  std::optional<std::size_t> keyframe;  ///< the old keyframe, where it was matched
};

/// A line of frames.jsonl.
struct FrameLine {
  std::size_t index = 0;  ///< in the dataset
  TimestampNs t_ns = 0;
  std::string status, reason;
  double keypoints = 0.0, stereo_points = 0.0, matches = 0.0, inliers = 0.0, rms_px = 0.0;
  std::optional<std::size_t> keyframe;  ///< its number, where the frame is one
  std::optional<LoopLine> loop;
};

/// Throws Error with file and line. A line without its end (a run that goes on, or was killed) is left out.
std::vector<FrameLine> read_frame_lines(const std::filesystem::path& run);

/// The columns of timings.csv without "frame", one row per line of the file. Empty where there is none.
Columns read_timings(const std::filesystem::path& run);

}  // namespace demslam

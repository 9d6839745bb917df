#pragma once

#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/dataset/row_offset.h"
#include "demslam/dataset/sequence.h"

namespace demslam {

/// What a dataset says of itself, without looking at its images.
struct DatasetInfo {
  std::string format;
  std::size_t pairs = 0, unpaired = 0;
  int width = 0, height = 0;
  double duration_s = 0.0;
  double median_rate_hz = 0.0;  ///< 0 for a single pair
  double longest_gap_s = 0.0;
  double baseline_m = 0.0;
  double focal_px = 0.0;  ///< of the left camera as calibrated
  bool has_dem = false, has_start = false;
};
DatasetInfo inspect(const StereoSequence& sequence);

struct DatasetCheckOptions {
  std::size_t frames = 20;  ///< spread over the sequence; 0: every frame
};

/// What its images say of a dataset.
struct DatasetCheck {
  std::size_t frames = 0;             ///< looked at
  RowOffset rows;                     ///< of the rectified pairs: zero for a good calibration
  std::vector<std::string> problems;  ///< frames that cannot be read
  std::vector<std::string> warnings;  ///< what makes results worse, and what to do
};
DatasetCheck check_dataset(const StereoSequence& sequence, const DatasetCheckOptions& options,
                           const Progress& progress);

}  // namespace demslam

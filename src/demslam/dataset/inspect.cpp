#include "demslam/dataset/inspect.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "demslam/base/error.h"
#include "demslam/image/rectify.h"

namespace demslam {
namespace {

constexpr double kLargestRowOffsetPx = 0.5;  // matching on the same row tolerates about a pixel
constexpr double kLargestRowSpreadPx = 0.75;
constexpr std::size_t kFewestPatches = 20;
constexpr double kLongGapMedians = 5.0;
constexpr double kDarkMean = 8.0, kBrightMean = 247.0;  // grey values

std::string text_of(const char* format, double value) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

std::vector<std::size_t> chosen_frames(std::size_t size, std::size_t count) {
  if (count == 0 || count > size) count = size;
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < count; ++i) frames.push_back(count == 1 ? 0 : i * (size - 1) / (count - 1));
  return frames;
}

double mean_of(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t pixel : image.pixels) sum += pixel;
  return sum / static_cast<double>(image.pixels.size());
}

void look_at_exposure(const StereoFrame& frame, std::size_t index, DatasetCheck& check) {
  const double mean = std::min(mean_of(frame.left), mean_of(frame.right));
  const double brightest = std::max(mean_of(frame.left), mean_of(frame.right));
  if (mean < kDarkMean) check.warnings.push_back("frame " + std::to_string(index) + " is nearly black");
  if (brightest > kBrightMean) check.warnings.push_back("frame " + std::to_string(index) + " is nearly white");
}

void judge_rows(DatasetCheck& check) {
  const RowOffset& rows = check.rows;
  if (rows.patches < kFewestPatches) {
    check.warnings.push_back("too little texture to measure the row offset (" + std::to_string(rows.patches) +
                             " patches)");
    return;
  }
  if (std::abs(rows.offset_px) > kLargestRowOffsetPx) {
    check.warnings.push_back(text_of("right rows lie %+.2f px below left ones after rectification; ", rows.offset_px) +
                             text_of("add %.2f to row_offset_px of the calibration", rows.offset_px));
  }
  if (rows.spread_px > kLargestRowSpreadPx) {
    check.warnings.push_back(
        text_of("the epipolar error spreads by %.2f px; the calibration does not fit these images", rows.spread_px));
  }
}

void judge_gaps(const DatasetInfo& info, DatasetCheck& check) {
  if (info.median_rate_hz > 0.0 && info.longest_gap_s * info.median_rate_hz > kLongGapMedians) {
    check.warnings.push_back(text_of("the longest gap between two pairs is %.2f s", info.longest_gap_s));
  }
  if (info.unpaired > 0)
    check.warnings.push_back(std::to_string(info.unpaired) + " images lack their partner and are left out");
}

}  // namespace

DatasetInfo inspect(const StereoSequence& sequence) {
  const StereoRig& rig = sequence.rig();
  DatasetInfo info{.format = sequence.format(),
                   .pairs = sequence.size(),
                   .unpaired = sequence.unpaired(),
                   .width = rig.left.width,
                   .height = rig.left.height};
  info.baseline_m = rig.T_left_right.translation().norm();
  info.focal_px = rig.left.fx;
  info.has_dem = sequence.dem_file().has_value();
  info.has_start = sequence.start().has_value();
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    intervals_s.push_back(to_seconds(sequence.stamp_ns(i) - sequence.stamp_ns(i - 1)));
  }
  if (intervals_s.empty()) return info;
  std::sort(intervals_s.begin(), intervals_s.end());
  info.duration_s = to_seconds(sequence.stamp_ns(sequence.size() - 1) - sequence.stamp_ns(0));
  info.median_rate_hz = 1.0 / intervals_s[intervals_s.size() / 2];
  info.longest_gap_s = intervals_s.back();
  return info;
}

DatasetCheck check_dataset(const StereoSequence& sequence, const DatasetCheckOptions& options,
                           const Progress& progress) {
  const Rectifier rectifier(sequence.rig());
  const std::vector<std::size_t> frames = chosen_frames(sequence.size(), options.frames);
  DatasetCheck check;
  std::vector<double> differences;
  for (const std::size_t index : frames) {
    if (progress.stop_requested()) break;
    try {
      const StereoFrame frame = sequence.frame(index);
      look_at_exposure(frame, index, check);
      const auto found = row_differences_px(rectifier.left(frame.left), rectifier.right(frame.right));
      differences.insert(differences.end(), found.begin(), found.end());
    } catch (const Error& error) {
      check.problems.emplace_back(error.what());
    }
    progress.report(++check.frames, frames.size());
  }
  check.rows = row_offset(std::move(differences));
  judge_rows(check);
  judge_gaps(inspect(sequence), check);
  return check;
}

}  // namespace demslam

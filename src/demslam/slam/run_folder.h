#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "demslam/dem/local_frame.h"
#include "demslam/slam/slam.h"

namespace demslam {

/// The files of a run (docs/run-folder.md):
///   trajectory.tum   anchored poses T_map_body of all tracked frames      odometry.tum   the same without DEM and
///   loops covariance.csv   6x6 per keyframe                                     frames.jsonl   one record per frame
///   residuals.csv    chi-square of every DEM, sun, skyline and prior factor at the end
///   config.toml      effective options                                    summary.json   inputs, counts, versions
///   map.db           the map (docs/map.md), from which an interrupted run goes on
///   timings.csv      wall-clock and memory per frame, the one file that differs between two identical runs
///   trajectory.geojson   longitude, latitude, height, when the DEM has a CRS
/// Results are written to temporary names and renamed, so that a reader never sees half a file.
class RunFolder {
 public:
  /// Creates the folder, changes nothing in an existing one. Throws Error when it cannot be made.
  explicit RunFolder(const std::filesystem::path& path);

  std::filesystem::path map_file() const { return path_ / "map.db"; }
  /// summary.json of a run that ended here, early or not.
  std::optional<std::string> summary() const;
  /// Removes an earlier run. Throws Error when another process is writing it.
  void clear();
  /// Opens frames.jsonl and timings.csv, the former with the lines of the frames already done. Throws Error when the
  /// folder cannot be written.
  void begin(const std::string& earlier_frames);

  void write_config(const std::string& toml);
  void append(const FrameRecord& record);  ///< frames.jsonl and timings.csv, flushed
  void write_result(const SlamResult& result, const LocalFrame* frame);
  void write_summary(const std::string& json);

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::ofstream frames_, timings_;
};

/// Writes `text` to a temporary name and renames it. Throws Error when the disk is full or the folder is not writable.
void write_file_atomically(const std::filesystem::path& file, const std::string& text);

}  // namespace demslam

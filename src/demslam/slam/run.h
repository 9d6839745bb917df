#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "demslam/base/progress.h"
#include "demslam/dataset/sequence.h"
#include "demslam/slam/slam.h"

namespace demslam {

/// What a run reads and where it writes.
struct RunInputs {
  std::filesystem::path dataset;
  std::string format;                                ///< empty: recognised
  std::optional<std::filesystem::path> dem;          ///< default: the dataset's own, if it has one
  std::optional<std::filesystem::path> dem_sigma;    ///< default: "dem_sigma.tif" beside "dem.tif"
  std::optional<std::filesystem::path> calibration;  ///< replaces the dataset's own
  std::optional<std::filesystem::path> start;        ///< start.toml; default: the dataset's own
  std::optional<std::filesystem::path> map;          ///< of an earlier run in the same map frame, or its folder
  double unknown_start_radius_m = 0.0;               ///< above 0: the start is only known to be within this distance of
                                                     ///< `start`, or of the DEM's middle where there is none
  std::optional<double> heading_deg;                 ///< of the first frame, where something tells it all the same
  std::filesystem::path output;                      ///< the run folder
  bool overwrite = false;                            ///< an earlier run there is removed; else it goes on
  std::size_t first_frame = 0, max_frames = 0;       ///< 0: to the end
  std::string config_toml;                           ///< effective options as text, stored beside the result
  /// How `dataset` is opened: path, format, calibration ("" each for the dataset's own).
  std::function<std::unique_ptr<StereoSequence>(const std::filesystem::path&, const std::string&,
                                                const std::filesystem::path&)>
      open = open_dataset;
};

struct RunReport {
  SlamResult result;
  std::size_t frames_in_dataset = 0, frames_asked = 0;
  std::size_t resumed_at = 0;        ///< first frame that was not done by an earlier part of the run
  bool interrupted = false;          ///< stopped early on request; the folder is valid and holds what was done
  bool anchored = false;             ///< a DEM was used
  std::optional<Vergence> vergence;  ///< as the window has found it; none of a replay, or where it was not asked to
  double seconds = 0.0;
};

/// The start as the graph takes it.
StartPrior prior_of(const StartPose& start);

/// Opens the dataset and the DEM, runs the SLAM over every frame and writes the run folder. Where the folder holds an
/// interrupted run of the same inputs and options, that one goes on after its last keyframe and ends as if it had never
/// stopped. Throws Error.
RunReport run_slam(const RunInputs& inputs, const SlamOptions& options, const Progress& progress);

}  // namespace demslam

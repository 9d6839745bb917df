#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/evaluation/table.h"
#include "demslam/experiment/finished_runs.h"
#include "demslam/experiment/petal_drive.h"

namespace demslam {

/// How the back-end's cost, memory and error grow with the way driven. No images: odometry, ground points and loops
/// come from a PetalDrive; the graph, the terrain patches, the loop closure and the map on disk are those of a run.
struct ScaleExperiment {
  std::vector<double> lengths_km = {1.0, 11.0, 100.0};
  int seeds = 1;
  DriveOptions drive;                               ///< its seed is the first one's; its length is replaced
  double optimise_every_m = 10.0;                   ///< besides right after a loop
  std::optional<std::filesystem::path> map_folder;  ///< where the map is written while driving, then removed
  int features_per_keyframe = 100;                  ///< in the map: 64 signed bytes of descriptor each
};

/// Processor milliseconds of the run's own thread per keyframe over a part of the way.
struct KeyframeCost {
  double median_ms = 0.0, p99_ms = 0.0, mean_ms = 0.0, longest_ms = 0.0;
};

struct ScaleRow {
  double length_km = 0.0;
  std::uint64_t seed = 0;
  std::size_t keyframes = 0;
  std::size_t variables = 0;  ///< that the graph holds at the end
  KeyframeCost all, first_km, last_km;
  double store_median_ms = 0.0, store_longest_ms = 0.0;
  std::size_t batches = 0;                          ///< beside the run
  double longest_batch_ms = 0.0, batches_ms = 0.0;  ///< processor time of their threads: of one, of all
  double longest_wait_ms = 0.0, waited_ms = 0.0;    ///< wall-clock time that the run stood still for one, for all
  double final_batch_ms = 0.0, covariances_ms = 0.0;
  int loops_accepted = 0, loops_off = 0;
  double peak_memory_mb = 0.0;  ///< of the process so far
  double map_mb_per_km = 0.0;
  double ate_odometry_m = 0.0;
  double ate_run_m = 0.0;       ///< of each keyframe when it was the newest
  double ate_final_m = 0.0;     ///< after the last batch
  double nees = 0.0;            ///< of the final positions, divided by 3
  double run_to_final_m = 0.0;  ///< RMS distance between the estimates when newest and the final ones
};

/// One row per length and seed, of the runs finished when `progress` asks to stop; those that `finished` holds are not
/// made again, new ones are put there. Throws Error when the map cannot be written.
std::vector<ScaleRow> scale_experiment(const ScaleExperiment& experiment, const FinishedRuns* finished = nullptr,
                                       const Progress& progress = {});

Table scale_table(const std::vector<ScaleRow>& rows);
std::string scale_json(const std::vector<ScaleRow>& rows);

}  // namespace demslam

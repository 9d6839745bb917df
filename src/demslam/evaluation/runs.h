#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "demslam/evaluation/evaluate.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/evaluation/truth.h"
#include "demslam/geometry/pose.h"

namespace demslam {

/// Where a dataset, or the dataset of a run folder, keeps its truth: gt.txt (demslam, LuSNAR), Rover_pose.txt (LuSNAR),
/// poses.txt or the odometry benchmark's poses/NN.txt (KITTI), mav0/state_groundtruth_estimate0 or mav0/mocap0 or
/// ground_truth_tum.txt (EuRoC, TUM-VI). Nothing when there is none.
std::optional<std::filesystem::path> find_truth(const std::filesystem::path& dataset_or_run);

/// The truth that is meant: the given file, the one found with a given dataset, else with the run. Nothing when there
/// is none.
std::optional<std::filesystem::path> truth_file(const std::filesystem::path& run_or_trajectory,
                                                const std::optional<std::filesystem::path>& given);

/// The DEM that a run was anchored to, from its summary.json; nothing where there is none.
std::optional<std::filesystem::path> dem_of_run(const std::filesystem::path& run);

/// KITTI poses have no stamps: they pair by index with poses that have none either, or are equally many.
bool pairs_by_index(const TrajectoryFile& truth, const TrajectoryFile& estimate);

/// What is to be added to the estimate's stamps: the offset given, or the one estimated.
double clock_offset_of(const Trajectory& truth, const Trajectory& estimate, const TruthOptions& options);

/// Is this a run folder, rather than a trajectory file?
bool is_run_folder(const std::filesystem::path& path);

/// The stamps of the frames a run was given, from its frames.jsonl; empty where there is none.
std::vector<TimestampNs> frame_stamps(const std::filesystem::path& run);

struct StampedCovariance {
  TimestampNs t_ns = 0;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, rotation first
};

/// A run's covariance.csv; empty where there is none.
std::vector<StampedCovariance> read_covariances(const std::filesystem::path& run);

/// Evaluates a run folder (trajectory.tum, frames.jsonl, covariance.csv) or a trajectory file against `truth`, or
/// against the truth found with the run's dataset. The NEES is computed where covariances are there and nothing is
/// aligned. Its notes say what was done to the truth. Throws Error when there is no truth or a file is broken.
Evaluation evaluate_run(const std::filesystem::path& run_or_trajectory,
                        const std::optional<std::filesystem::path>& truth, EvaluationOptions options,
                        TruthOptions truth_options = {});

}  // namespace demslam

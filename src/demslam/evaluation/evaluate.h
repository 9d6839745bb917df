#pragma once

#include <optional>
#include <string>
#include <vector>

#include "demslam/evaluation/alignment.h"
#include "demslam/evaluation/association.h"
#include "demslam/evaluation/metrics.h"
#include "demslam/evaluation/nees.h"

namespace demslam {

struct EvaluationOptions {
  Alignment alignment = Alignment::none;  ///< of everything that is not named after another one
  AssociationOptions association;
  RpeOptions rpe;
  std::vector<TimestampNs> frame_stamps;  ///< of the frames the run was given, in increasing order, where known
};

/// The position error of one pose, S * estimate - truth, in the truth's axes (map: East, North, Up).
struct PoseError {
  TimestampNs t_ns = 0;     ///< of the estimate
  double distance_m = 0.0;  ///< along the truth since the first pair
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();
};

/// How far an estimate lies from the truth. Lengths in metres.
struct Evaluation {
  Alignment alignment = Alignment::none;
  RpeOptions rpe_options;
  std::size_t poses = 0;        ///< pairs compared
  double clock_offset_s = 0.0;  ///< that was added to the estimate's stamps
  double path_length_m = 0.0;   ///< of the truth at its own rate, from the first pair to the last

  ErrorStatistics ate;                           ///< under `alignment`
  ErrorStatistics ate_horizontal, ate_vertical;  ///< its parts, the truth's z being up
  std::optional<ErrorStatistics> ate_unaligned, ate_first_pose, ate_se3, ate_sim3;  ///< nothing: see `notes`
  std::optional<double> sim3_scale;
  double ate_star = 0.0;  ///< ATE RMSE / path length; NaN when the truth does not move
  double drift_percent =
      0.0;  ///< error of the last pair under `alignment`, in percent of the path length; NaN likewise

  std::optional<ErrorStatistics> rpe;               ///< metres
  std::optional<ErrorStatistics> rpe_rotation_deg;  ///< nothing: see `notes`

  /// With frame stamps: the share of the frames that have a pose. Without: the share of the truth's time span that lies
  /// between two estimated poses no further apart than three times their median interval.
  double completion = 0.0;

  std::optional<Nees> nees;  ///< set by evaluate_run() where the run has covariances
  std::vector<PoseError> errors;
  std::vector<std::string> notes;  ///< what was done to the truth, what was refused, and why
};

/// Compares positions and relative poses of one trajectory with the truth, as evo does. Both must speak of the same
/// point of the rover. Throws Error when nothing pairs or the alignment asked for is not determined.
Evaluation evaluate(const Trajectory& truth, const Trajectory& estimate, const EvaluationOptions& options = {});

/// One JSON object: ate_rmse_m, ate_se3_rmse_m, ..., null for what was refused.
std::string evaluation_json(const Evaluation& evaluation);

/// "over 1 frame, consecutive pairs".
std::string describe(const RpeOptions& options);

}  // namespace demslam

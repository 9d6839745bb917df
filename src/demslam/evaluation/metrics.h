#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "demslam/evaluation/alignment.h"
#include "demslam/evaluation/association.h"

namespace demslam {

/// Of a list of errors, in their unit.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0.0, mean = 0.0, median = 0.0, std = 0.0, min = 0.0, max = 0.0;
};

/// `errors` must not be empty.
ErrorStatistics statistics(std::vector<double> errors);

/// Absolute errors: position of S * estimate - truth, metres, axes of the truth.
std::vector<Eigen::Vector3d> position_errors(const PosePairs& pairs, const Similarity& S);

enum class DeltaUnit { frames, metres, seconds };
enum class RpePairs {
  consecutive,  ///< each pair begins where the one before ended
  all,          ///< from every pose
};

struct RpeOptions {
  double delta = 1.0;
  DeltaUnit unit = DeltaUnit::frames;
  RpePairs pairs = RpePairs::consecutive;
  double relative_tolerance = 0.1;  ///< of delta; for all pairs in metres or seconds
};

using IndexPair = std::pair<std::size_t, std::size_t>;

/// The poses compared by the RPE, chosen on the estimate as evo does: by index, or by the path driven (metres; seconds
/// likewise by the time passed, which evo does not have). May be empty.
std::vector<IndexPair> delta_pairs(const Trajectory& estimate, const RpeOptions& options);

/// One error per pair. Translation and rotation angle of (T_i^-1 T_j)^-1 (That_i^-1 That_j), metres and radians.
std::vector<double> relative_translation_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices);
std::vector<double> relative_rotation_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices);
/// | |p_j - p_i| - |phat_j - phat_i| |, metres: needs no rotations.
std::vector<double> relative_distance_errors(const PosePairs& pairs, const std::vector<IndexPair>& indices);

}  // namespace demslam

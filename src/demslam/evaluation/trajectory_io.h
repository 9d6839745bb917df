#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "demslam/geometry/trajectory.h"

namespace demslam {

enum class TrajectoryFormat {
  tum,    ///< blanks; seconds, position, quaternion xyzw
  kitti,  ///< blanks; 12 numbers, the upper rows of the pose; no stamps
  euroc,  ///< commas; nanoseconds, position, quaternion wxyz, then anything (EuRoC truth, TUM-VI mocap, LuSNAR gt.txt)
};

std::string_view name_of(TrajectoryFormat format);

/// A trajectory as a file holds it.
struct TrajectoryFile {
  Trajectory poses;
  TrajectoryFormat format = TrajectoryFormat::tum;
  /// KITTI without a times.txt: the stamps are index * 0.1 s, and trajectories pair by index (see `associate`).
  bool indexed = false;
};

/// Reads a trajectory; the format is recognised by its content. Stamps are taken over exactly, as text; those of a TUM
/// file that cannot be seconds (1e10 and above) are nanoseconds, as ORB-SLAM3 writes them. A KITTI file takes its
/// stamps from times.txt beside it, or from sequences/NN/times.txt of the KITTI layout, when the counts agree. Throws
/// Error with file and line: wrong column count, no number or NaN, no rotation, stamps that do not increase (duplicates
/// included: which of the two poses is meant cannot be known), no pose at all.
TrajectoryFile read_trajectory(const std::filesystem::path& file);
TrajectoryFile parse_trajectory(std::string_view text, const std::string& source);

std::string tum_text(const Trajectory& trajectory);
std::string kitti_text(const Trajectory& trajectory);
std::string euroc_text(const Trajectory& trajectory);

/// False when every rotation is the identity: positions alone (GNSS), written with a placeholder quaternion.
bool has_rotation(const Trajectory& trajectory);

}  // namespace demslam

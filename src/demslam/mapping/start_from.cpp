#include "demslam/mapping/start_from.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

constexpr TimestampNs kTolerance_ns = 100'000'000;  // before the first pose, or after the last one

using At = Trajectory::const_iterator;

At first_not_before(const Trajectory& track, TimestampNs t_ns) {
  return std::lower_bound(track.begin(), track.end(), t_ns,
                          [](const StampedPose& pose, TimestampNs t) { return pose.t_ns < t; });
}

Pose interpolated(const Trajectory& track, TimestampNs t_ns) {
  const At after = first_not_before(track, t_ns);
  if (after == track.begin()) return track.front().pose;
  if (after == track.end()) return track.back().pose;
  const StampedPose &a = *(after - 1), &b = *after;
  const double share = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  return Pose(a.pose.rotation().slerp(share, b.pose.rotation()),
              (1.0 - share) * a.pose.translation() + share * b.pose.translation());
}

Eigen::Quaterniond heading_of_motion(const Trajectory& track, TimestampNs t_ns, const Eigen::Vector3d& from,
                                     double path_m) {
  for (At at = first_not_before(track, t_ns); at != track.end(); ++at) {
    const Eigen::Vector2d way = (at->pose.translation() - from).head<2>();
    if (way.norm() >= path_m) return rotation_from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()));
  }
  throw Error("the positions never get " + std::to_string(path_m) +
              " m away from the first frame's, so there is no heading; write start.toml by hand");
}

}  // namespace

StartPose start_from(const Trajectory& track, TimestampNs t_ns, const StartFromOptions& options) {
  if (track.empty() || t_ns < track.front().t_ns - kTolerance_ns || t_ns > track.back().t_ns + kTolerance_ns) {
    throw Error("the track does not reach over the first frame at " + seconds_text(t_ns) +
                " s; check the files, or give a clock offset");
  }
  const bool rotations = has_rotation(track);
  StartPose start{.T_map_body = interpolated(track, t_ns), .sigma_position_m = options.sigma_position_m};
  if (!rotations) {
    const Eigen::Vector3d p = start.T_map_body.translation();
    start.T_map_body = Pose(heading_of_motion(track, t_ns, p, options.heading_path_m), p);
  }
  const double usual_deg = rotations ? 0.1 : 5.0;
  start.sigma_rotation_rad = kRadPerDeg * (options.sigma_rotation_deg > 0.0 ? options.sigma_rotation_deg : usual_deg);
  return start;
}

}  // namespace demslam

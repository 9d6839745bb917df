#include <algorithm>

#include "demslam/base/error.h"
#include "demslam/report/internal/run_map.h"

namespace demslam {

const Pose* pose_at(const Trajectory& trajectory, TimestampNs t_ns) {
  const auto it = std::lower_bound(trajectory.begin(), trajectory.end(), t_ns,
                                   [](const StampedPose& stamped, TimestampNs t) { return stamped.t_ns < t; });
  return it == trajectory.end() || it->t_ns != t_ns ? nullptr : &it->pose;
}

std::vector<KeyframePose> keyframe_poses(const ReportRun& run) {
  std::vector<KeyframePose> keyframes;
  for (const FrameLine& frame : run.frames) {
    const Pose* pose = frame.keyframe ? pose_at(run.trajectory, frame.t_ns) : nullptr;
    if (pose != nullptr) keyframes.push_back({*frame.keyframe, frame.index, frame.t_ns, *pose});
  }
  return keyframes;
}

std::optional<MapStore> open_map(const ReportRun& run, std::vector<std::string>& notes) {
  const std::filesystem::path file = run.folder / "map.db";
  if (!std::filesystem::exists(file)) {
    notes.push_back(run.name + ": no map.db, hence no features in the images and no chi-square of the factors");
    return std::nullopt;
  }
  try {
    return MapStore::open_read_only(file);
  } catch (const Error& error) {
    notes.push_back(run.name + ": " + error.what());
    return std::nullopt;
  }
}

}  // namespace demslam

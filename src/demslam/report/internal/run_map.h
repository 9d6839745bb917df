#pragma once

#include <optional>
#include <string>
#include <vector>

#include "demslam/report/run_report.h"
#include "demslam/store/map_store.h"

namespace demslam {

/// A keyframe of a run and its final pose.
struct KeyframePose {
  std::size_t number = 0, frame = 0;
  TimestampNs t_ns = 0;
  Pose T_map_body;
};

/// The keyframes that frames.jsonl names and trajectory.tum places.
std::vector<KeyframePose> keyframe_poses(const ReportRun& run);

/// The pose at exactly this time; null where there is none.
const Pose* pose_at(const Trajectory& trajectory, TimestampNs t_ns);

/// The run's map.db; nothing, and a note, where it is missing or damaged.
std::optional<MapStore> open_map(const ReportRun& run, std::vector<std::string>& notes);

}  // namespace demslam

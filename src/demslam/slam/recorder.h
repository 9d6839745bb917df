#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "demslam/slam/slam.h"
#include "demslam/store/map_store.h"

namespace demslam {

/// Writes a run into its map as it goes: a keyframe, with all that has happened since the one before, is one
/// transaction.
class Recorder {
 public:
  /// `map` and `slam` must outlive it. Keyframes that the slam has already are taken to be in the map.
  Recorder(MapStore& map, Slam& slam);

  /// Right after the slam has processed the record's frame.
  void add(const FrameRecord& record);
  /// The frames since the last keyframe and the estimates at the end.
  void finish(const SlamResult& result);

 private:
  std::vector<std::pair<std::size_t, Pose>> moved_keyframes();
  void store_loop(const LoopResult& loop, std::size_t keyframe, KeyframeEntry& entry);

  MapStore& map_;
  Slam& slam_;
  std::vector<StoredFrame> frames_;                                          ///< since the last keyframe
  std::vector<Pose> written_;                                                ///< T_map_body as it stands in the map
  std::size_t factors_ = 0;                                                  ///< in the map
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> loop_factors_;  ///< by the loop's keyframes
};

/// What a map holds of a keyframe: what the odometry said, and what the images said of loops.
struct RecordedKeyframe {
  OdometryResult odometry;
  std::vector<Motion> verified;
};

using FrameVisitor = std::function<void(const StoredFrame&, const FramePlace&, Tracking)>;
using KeyframeVisitor = std::function<void(const StoredFrame&, RecordedKeyframe)>;
/// Every frame that a map holds, in turn.
void for_each_recorded_frame(const MapStore& map, const FrameVisitor& visit_frame,
                             const KeyframeVisitor& visit_keyframe);

/// Repeats what a map holds of an earlier part of the run, up to its last keyframe, so that `slam` goes on exactly as
/// it would have. `pair_at` gives the few images that the odometry still looks at. Drops what the map holds beyond that
/// keyframe. Throws Error when the images or the program are not those of the earlier part.
void resume(Slam& slam, MapStore& map, const PairSource& pair_at);

}  // namespace demslam

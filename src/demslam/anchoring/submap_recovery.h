#pragma once

#include <memory>
#include <optional>

#include "demslam/anchoring/recent_ground.h"
#include "demslam/anchoring/submap_alignment.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

/// What the searches came to.
struct SubmapReport {
  int searched = 0, accepted = 0;
  int moved = 0;  ///< times the estimate was moved to where the search found it
};

/// Looks for the last stretch of ground on the DEM every so often, and brings the graph back when it is in the wrong
/// place. A fix that the graph's own covariance allows is believed at once; one that it does not must be confirmed by
/// the next search.
class SubmapRecovery {
 public:
  SubmapRecovery(std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error, const PatchOptions& patch,
                 const PatchFactorOptions& factor, const SubmapOptions& options, const Pose& T_body_left);

  /// Ground points of a keyframe that advance() has not come to yet.
  void add(const KeyframeLandmarks& landmarks) { ground_.add(landmarks); }
  /// The graph has reached `keyframe`, `step_m` after the one before.
  void advance(PoseGraph& graph, std::size_t keyframe, double step_m);
  const SubmapReport& report() const { return report_; }

 private:
  void search(PoseGraph& graph);
  void use(PoseGraph& graph, std::size_t keyframe, const TerrainFix& fix);
  bool believed(const PoseGraph& graph, const TerrainFix& fix, const Pose& T_correction);

  std::shared_ptr<const Dem> dem_;
  DemErrorModel dem_error_;
  PatchOptions patch_;
  PatchFactorOptions factor_;
  SubmapOptions options_;
  RecentGround ground_;
  double searched_at_m_ = 0.0;
  std::size_t sure_until_ = 0;   ///< keyframe; from it on the estimate may be moved
  std::optional<Pose> pending_;  ///< a correction that waits for its confirmation
  SubmapReport report_;
};

}  // namespace demslam

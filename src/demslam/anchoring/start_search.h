#pragma once

#include <memory>
#include <optional>

#include "demslam/anchoring/global_fix.h"
#include "demslam/anchoring/recent_ground.h"

namespace demslam {

struct StartSearchOptions {
  GlobalFixOptions fix{.sigma_tilt_deg = 8.0};  ///< centre and radius are of the start; a heading is that of the
                                                ///< graph's own x axis
  /// Where the graph begins on the map instead of in a frame of its own: the covariance of that start. Three sigmas
  /// around the graph's own estimate are searched, 30 to 500 m.
  std::optional<Matrix6d> around;
  double length_m = 150.0;  ///< of path whose ground is searched for
  double first_m = 60.0;    ///< of path before the first search
  double every_m = 20.0;    ///< between searches
};

/// For a start on the map that may be off by more than `vague_m` (one sigma, horizontal; 0: never).
std::optional<StartSearchOptions> search_for_vague_start(const Pose& T_map_body, const Matrix6d& covariance,
                                                         double vague_m);

/// A rover that does not know where it is drives on and looks, again and again, whether the ground it has seen fits one
/// place within the radius and no other.
class StartSearch {
 public:
  StartSearch(std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error, const PatchOptions& patch,
              const PatchFactorOptions& factor, const StartSearchOptions& options, const Pose& T_body_left);

  void add(const KeyframeLandmarks& landmarks) { ground_.add(landmarks); }
  /// The graph has reached `keyframe`. The way from its frame into the map, once it is found.
  std::optional<Pose> advance(const PoseGraph& graph, std::size_t keyframe, double step_m);
  /// Of the last search; the keyframe it speaks of is keyframe().
  const TerrainFix& fix() const { return fix_; }
  std::size_t keyframe() const { return keyframe_; }
  int searches() const { return searches_; }

 private:
  GlobalFixOptions window(const PoseGraph& graph) const;

  std::shared_ptr<const Dem> dem_;
  DemErrorModel dem_error_;
  PatchOptions patch_;
  PatchFactorOptions factor_;
  StartSearchOptions options_;
  RecentGround ground_;
  TerrainFix fix_;
  std::size_t keyframe_ = 0;
  double searched_at_m_ = 0.0;
  int searches_ = 0;
};

}  // namespace demslam

#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

/// The landmarks of the last stretch of path, to make a submap of.
class RecentGround {
 public:
  RecentGround(double length_m, const Pose& T_body_left) : length_m_(length_m), T_body_left_(T_body_left) {}

  /// Ground points of a keyframe that advance() has not come to yet.
  void add(const KeyframeLandmarks& landmarks);
  /// The rover has reached `keyframe`, `step_m` after the one before.
  void advance(std::size_t keyframe, double step_m);
  double path_m() const { return path_m_; }
  std::size_t reached() const { return reached_; }
  /// The keyframe in the middle of the stretch.
  std::size_t middle() const;
  /// The landmarks with their keyframes' present estimates.
  std::vector<PosedLandmarks> views(const PoseGraph& graph) const;
  /// How far off the middle keyframe is, at least, when all of the stretch is found at once: odometry has bent it.
  /// Nothing where the stretch is not joined by odometry.
  std::optional<Matrix6d> bend(const PoseGraph& graph) const;

 private:
  struct Seen {
    KeyframeLandmarks landmarks;
    double path_m = 0.0;
  };

  double length_m_;
  Pose T_body_left_;
  std::deque<Seen> seen_;
  double path_m_ = 0.0;
  std::size_t reached_ = 0;
};

}  // namespace demslam

#include "demslam/anchoring/recent_ground.h"

namespace demslam {

void RecentGround::add(const KeyframeLandmarks& landmarks) { seen_.push_back({landmarks, path_m_}); }

void RecentGround::advance(std::size_t keyframe, double step_m) {
  path_m_ += step_m;
  reached_ = keyframe;
  for (auto seen = seen_.rbegin(); seen != seen_.rend() && seen->landmarks.keyframe >= keyframe; ++seen)
    seen->path_m = path_m_;
  while (!seen_.empty() && seen_.front().path_m < path_m_ - length_m_) seen_.pop_front();
}

std::size_t RecentGround::middle() const {
  return seen_.empty() ? reached_ : (seen_.front().landmarks.keyframe + reached_) / 2;
}

std::optional<Matrix6d> RecentGround::bend(const PoseGraph& graph) const {
  if (seen_.empty()) return std::nullopt;
  return graph.odometry_bend(seen_.front().landmarks.keyframe, middle(), reached_);
}

std::vector<PosedLandmarks> RecentGround::views(const PoseGraph& graph) const {
  std::vector<PosedLandmarks> views;
  for (const Seen& seen : seen_) {
    if (seen.landmarks.keyframe > reached_) continue;
    views.push_back({graph.T_map_body(seen.landmarks.keyframe) * T_body_left_, &seen.landmarks.points});
  }
  return views;
}

}  // namespace demslam

#include <algorithm>

#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/pose_graph_problem.h"

namespace demslam {
namespace {

constexpr std::size_t kLongest = 100;    // keyframes compounded into one motion
constexpr double kLongestPath_m = 50.0;  // and their path

}  // namespace

bool PoseGraphProblem::foldable(std::size_t keyframe) const {
  return !held[keyframe] && keyframe + 1 < poses.size() && chain.linked(keyframe) && chain.linked(keyframe + 1) &&
         stretch_of[keyframe] == stretch_of[keyframe + 1];
}

std::size_t PoseGraphProblem::held_before(std::size_t keyframe) const {
  do --keyframe;
  while (folded[keyframe]);
  return keyframe;
}

std::size_t PoseGraphProblem::held_after(std::size_t keyframe) const {
  do ++keyframe;
  while (keyframe < folded.size() && folded[keyframe]);
  return keyframe;
}

void PoseGraphProblem::fold_until(std::size_t end) {
  while (folded_until < end) {
    const std::size_t a = held_before(folded_until);
    while (folded_until < end && foldable(folded_until) && folded_until - a < kLongest &&
           chain.path_m(folded_until) - chain.path_m(a) < kLongestPath_m) {
      folded[folded_until] = true;
      values.erase(folded_until);
      factors.set_link(nullptr, folded_until);
      ++folded_until;
    }
    if (folded_until > a + 1) factors.set_link(link(a, folded_until), a);
    if (folded_until < end) ++folded_until;  // it stays, and the next motion starts there
  }
}

void PoseGraphProblem::unfold(std::size_t keyframe) {
  const std::size_t a = held_before(keyframe), b = held_after(keyframe);
  folded[keyframe] = false;
  values.insert(keyframe, to_gtsam(poses[keyframe]));
  factors.set_link(link(a, keyframe), a);
  factors.set_link(link(keyframe, b), keyframe);
}

void PoseGraphProblem::place_folded(std::size_t begin) {
  for (std::size_t a = begin, b; (b = held_after(a)) < poses.size(); a = b) {
    if (b == a + 1) continue;
    const auto between = chain.between(a, b, poses[a], poses[b], systematic(stretch_of[b]));
    std::copy(between.begin(), between.end(), poses.begin() + static_cast<std::ptrdiff_t>(a) + 1);
  }
}

}  // namespace demslam

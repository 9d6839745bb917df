#include <algorithm>
#include <cmath>
#include <utility>

#include "demslam/graph/loop_closure.h"
#include "demslam/graph/loop_consistency.h"

namespace demslam {

bool LoopClosure::agree(const PoseGraph& graph, const RelativePose& a, const RelativePose& b) const {
  const double apart_m =
      std::max(std::abs(graph.path_m(a.i) - graph.path_m(b.i)), std::abs(graph.path_m(a.j) - graph.path_m(b.j)));
  return apart_m <= options_.confirming_radius_m && loops_apart(graph, a, b) <= options_.agreement_gate;
}

void LoopClosure::wait(const PoseGraph& graph, const LoopResult& loop) {
  Waiting waiting{loop, came_++, {}};
  for (const Waiting& earlier : waiting_) {
    if (agree(graph, earlier.loop.measurement, loop.measurement)) waiting.agrees_with.push_back(earlier.number);
  }
  waiting_.push_back(std::move(waiting));
}

/// Of those waiting: the first one, and all later and earlier ones, in turn, that agree with it and with each other.
/// In the order of their coming.
std::vector<std::size_t> LoopClosure::agreeing(std::size_t first) const {
  const auto agree = [&](std::size_t a, std::size_t b) {
    return std::ranges::binary_search(waiting_[std::max(a, b)].agrees_with, waiting_[std::min(a, b)].number);
  };
  std::vector<std::size_t> group{first};
  for (std::size_t other = 0; other < waiting_.size(); ++other) {
    if (std::ranges::all_of(group, [&](std::size_t member) { return agree(member, other); })) group.push_back(other);
  }
  std::ranges::sort(group);
  return group;
}

bool LoopClosure::is_confirmed(const PoseGraph& graph, const std::vector<std::size_t>& group) const {
  std::vector<std::size_t> keyframes;  // in order, as they came
  keyframes.reserve(group.size());
  for (const std::size_t n : group) keyframes.push_back(waiting_[n].loop.measurement.j);
  keyframes.erase(std::ranges::unique(keyframes).begin(), keyframes.end());
  return std::ssize(keyframes) >= options_.confirming_keyframes &&
         graph.path_m(keyframes.back()) - graph.path_m(keyframes.front()) >= options_.confirming_path_m;
}

void LoopClosure::confirm(PoseGraph& graph, std::vector<LoopResult>& changed) {
  for (std::size_t n = 0; n < waiting_.size();) {
    const std::vector<std::size_t> group = agreeing(n);
    if (!is_confirmed(graph, group)) {
      ++n;
      continue;
    }
    accept(graph, group, changed);
    n = 0;
  }
}

void LoopClosure::accept(PoseGraph& graph, const std::vector<std::size_t>& group, std::vector<LoopResult>& changed) {
  Group accepted;
  std::vector<RelativePose> measurements;
  measurements.reserve(group.size());
  for (const std::size_t n : group) {
    LoopResult& loop = waiting_[n].loop;
    loop.status = LoopStatus::accepted;
    loop.reason.clear();
    measurements.push_back(loop.measurement);
    accepted.members.push_back(loop);
  }
  accepted.loop = graph.add_loop(std::move(measurements));
  std::erase_if(waiting_, [](const Waiting& w) { return w.loop.status == LoopStatus::accepted; });
  changed.insert(changed.end(), accepted.members.begin(), accepted.members.end());
  counters_.accepted += static_cast<int>(accepted.members.size());
  groups_.push_back(std::move(accepted));
  quiet_until_m_ = graph.path_m(graph.size() - 1) + options_.spacing_m;
}

void LoopClosure::expire(const PoseGraph& graph, std::vector<LoopResult>& changed) {
  const double path_m = graph.path_m(graph.size() - 1);
  for (Waiting& waiting : waiting_) {
    LoopResult& loop = waiting.loop;
    if (path_m - graph.path_m(loop.measurement.j) <= options_.confirming_radius_m) continue;
    loop.status = LoopStatus::rejected;
    loop.reason = "no other keyframe's loop agrees";
    ++counters_.rejected;
    changed.push_back(loop);
  }
  std::erase_if(waiting_, [](const Waiting& w) { return w.loop.status == LoopStatus::rejected; });
}

std::vector<LoopResult> LoopClosure::review(const PoseGraph& graph) {
  std::vector<LoopResult> changed;
  for (Group& group : groups_) {
    const bool on = graph.loop_is_on(group.loop);
    if (on == (group.members.front().status == LoopStatus::accepted)) continue;
    for (LoopResult& loop : group.members) {
      loop.status = on ? LoopStatus::accepted : LoopStatus::switched_off;
      loop.reason = on ? "" : "the rest of the graph contradicts it";
      counters_.rejected_later += on ? -1 : 1;
      changed.push_back(loop);
    }
  }
  return changed;
}

}  // namespace demslam

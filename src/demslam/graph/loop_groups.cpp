#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "demslam/graph/loop_closure.h"
#include "demslam/graph/loop_consistency.h"

namespace demslam {
namespace {

constexpr std::size_t kRemembered = 300;  // groups that a new one is compared with

template <class Groups>
auto latest(const Groups& groups) {
  return groups.end() - static_cast<std::ptrdiff_t>(std::min(groups.size(), kRemembered));
}

}  // namespace

bool LoopClosure::agree(const PoseGraph& graph, std::size_t a, std::size_t b) const {
  const RelativePose &m = candidates_[a].result.measurement, &o = candidates_[b].result.measurement;
  const double apart_m =
      std::max(std::abs(graph.path_m(m.i) - graph.path_m(o.i)), std::abs(graph.path_m(m.j) - graph.path_m(o.j)));
  return apart_m <= options_.confirming_radius_m && loops_apart(graph, m, o) <= options_.agreement_gate;
}

/// Those waiting that agree with the candidate and with each other, taken in the order of their coming.
LoopClosure::Group LoopClosure::agreeing(const PoseGraph& graph, std::size_t candidate) const {
  Group group{candidate};
  for (const std::size_t other : waiting_) {
    const auto agrees = [&](std::size_t member) { return member != other && agree(graph, member, other); };
    if (std::all_of(group.begin(), group.end(), agrees)) group.push_back(other);
  }
  return group;
}

bool LoopClosure::is_confirmed(const PoseGraph& graph, const Group& group) const {
  std::set<std::size_t> keyframes;
  for (const std::size_t c : group) keyframes.insert(candidates_[c].result.measurement.j);
  return std::ssize(keyframes) >= options_.confirming_keyframes &&
         graph.path_m(*keyframes.rbegin()) - graph.path_m(*keyframes.begin()) >= options_.confirming_path_m;
}

/// By their first loops, through the odometry between them.
bool LoopClosure::contradict(const PoseGraph& graph, const Group& a, const Group& b) const {
  return loops_apart(graph, candidates_[a.front()].result.measurement, candidates_[b.front()].result.measurement) >
         options_.gate;
}

void LoopClosure::confirm(PoseGraph& graph, std::vector<LoopResult>& changed) {
  for (std::size_t n = 0; n < waiting_.size();) {
    Group group = agreeing(graph, waiting_[n]);
    if (!is_confirmed(graph, group)) {
      ++n;
      continue;
    }
    std::erase_if(waiting_, [&](std::size_t c) { return std::ranges::find(group, c) != group.end(); });
    decide(graph, std::move(group), changed);
    n = 0;
  }
}

void LoopClosure::decide(PoseGraph& graph, Group group, std::vector<LoopResult>& changed) {
  std::vector<std::size_t> against, allies;  // indices of accepted and refused groups
  std::size_t number_against = 0, number_for = group.size();
  for (auto other = latest(accepted_); other != accepted_.end(); ++other) {
    if (!contradict(graph, group, *other)) continue;
    against.push_back(static_cast<std::size_t>(other - accepted_.begin()));
    number_against += other->size();
  }
  const bool believed = std::ranges::all_of(group, [&](std::size_t c) { return candidates_[c].believed; });
  if (against.empty() && !believed) return refuse(group, "the graph does not believe it", changed);
  if (against.empty()) return accept(graph, group, changed);
  for (auto other = latest(refused_); other != refused_.end(); ++other) {
    const bool agrees_with_all =
        !contradict(graph, group, *other) &&
        std::ranges::all_of(allies, [&](std::size_t ally) { return !contradict(graph, refused_[ally], *other); });
    if (!agrees_with_all) continue;
    allies.push_back(static_cast<std::size_t>(other - refused_.begin()));
    number_for += other->size();
  }
  if (number_for <= number_against) return refuse(group, "outnumbered by loops that contradict it", changed);
  std::vector<Group> defeated, supporting{std::move(group)};
  for (auto n = against.rbegin(); n != against.rend(); ++n) {
    defeated.push_back(std::move(accepted_[*n]));
    accepted_.erase(accepted_.begin() + static_cast<std::ptrdiff_t>(*n));
  }
  for (auto n = allies.rbegin(); n != allies.rend(); ++n) {
    supporting.push_back(std::move(refused_[*n]));
    refused_.erase(refused_.begin() + static_cast<std::ptrdiff_t>(*n));
  }
  for (const Group& one : defeated) {
    for (const std::size_t c : one) graph.switch_loop(*candidates_[c].loop, false);
    refused_.push_back(one);
  }
  for (const Group& one : supporting) accept(graph, one, changed);
  const auto reviewed = review(graph);
  changed.insert(changed.end(), reviewed.begin(), reviewed.end());
}

void LoopClosure::accept(PoseGraph& graph, const Group& group, std::vector<LoopResult>& changed) {
  for (const std::size_t c : group) {
    Candidate& candidate = candidates_[c];
    if (candidate.loop) {  // it was accepted before: review() will tell
      graph.switch_loop(*candidate.loop, true);
      continue;
    }
    counters_.rejected -= candidate.result.status == LoopStatus::rejected;
    ++counters_.accepted;
    candidate.loop = graph.add_loop(candidate.result.measurement);
    candidate.result.status = LoopStatus::accepted;
    candidate.result.reason.clear();
    changed.push_back(candidate.result);
  }
  accepted_.push_back(group);
  quiet_until_m_ = graph.path_m(graph.size() - 1) + options_.spacing_m;
}

void LoopClosure::refuse(const Group& group, const char* reason, std::vector<LoopResult>& changed) {
  for (const std::size_t c : group) {
    LoopResult& result = candidates_[c].result;
    result.status = LoopStatus::rejected;
    result.reason = reason;
    ++counters_.rejected;
    changed.push_back(result);
  }
  refused_.push_back(group);
}

void LoopClosure::expire(const PoseGraph& graph, std::vector<LoopResult>& changed) {
  const double path_m = graph.path_m(graph.size() - 1);
  std::erase_if(waiting_, [&](std::size_t c) {
    LoopResult& result = candidates_[c].result;
    if (path_m - graph.path_m(result.measurement.j) <= options_.confirming_radius_m) return false;
    result.status = LoopStatus::rejected;
    result.reason = "no other keyframe's loop agrees";
    ++counters_.rejected;
    changed.push_back(result);
    return true;
  });
}

std::vector<LoopResult> LoopClosure::review(const PoseGraph& graph) {
  std::vector<LoopResult> changed;
  for (Candidate& candidate : candidates_) {
    if (!candidate.loop) continue;
    const bool on = graph.loop_is_on(*candidate.loop);
    if (on == (candidate.result.status == LoopStatus::accepted)) continue;
    candidate.result.status = on ? LoopStatus::accepted : LoopStatus::switched_off;
    candidate.result.reason = on ? "" : "other loops contradict it";
    counters_.rejected_later += on ? -1 : 1;
    changed.push_back(candidate.result);
  }
  return changed;
}

}  // namespace demslam

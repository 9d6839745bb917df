#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "demslam/base/time.h"
#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

constexpr double kShortestBatchPath_m = 20.0;  // between two batches in the run
constexpr double kNearlyConverged = 1e-4;      // a batch in the run is followed by others

}  // namespace

OptimizerReport PoseGraphProblem::solve_all(double tolerance) {
  past = {};
  OptimizerReport report = solve(options.max_iterations, tolerance);
  const std::vector<bool> before = loops_on();
  if (!loops.empty() && sort_out_loops()) {
    const std::vector<bool> after = loops_on();
    report.loops_switched =
        std::inner_product(before.begin(), before.end(), after.begin(), 0, std::plus{}, std::not_equal_to{});
    const OptimizerReport again = solve(options.max_iterations, tolerance);
    report.error_after = again.error_after;
    report.iterations += again.iterations;
    report.milliseconds += again.milliseconds;
  }
  report.batch = true;
  return report;
}

OptimizerReport PoseGraph::optimize() {
  State& s = *state_;
  s.check_tied();
  if (s.under_way) s.adopt(std::exchange(s.under_way, std::nullopt)->take());
  const OptimizerReport report = s.solve_all(State::kConverged);
  ++s.batches;
  s.loops_waiting = 0;
  s.path_at_batch_m = path_m(size() - 1);
  return report;
}

OptimizerReport PoseGraph::State::solve_window() {
  const OptimizerReport report = solve(options.max_iterations);
  note_newest();
  return report;
}

OptimizerReport PoseGraph::optimize_window(std::size_t first) {
  State& s = *state_;
  s.check_tied();
  s.past.extend_to(first, s.factors, s.values);
  s.fold_until(first);
  return s.solve_window();
}

bool PoseGraph::State::batch_is_due() const {
  if (loops_waiting == 0 || under_way) return false;
  const double path_m = chain.path_m(poses.size() - 1), since_m = path_m - path_at_batch_m;
  if (batches > 0 && since_m < std::max(kShortestBatchPath_m, options.batch_every * path_m)) return false;
  constexpr double kTellsSomething = 12.59;  // chi-square of 6 degrees of freedom, 95 %
  return std::any_of(loops.end() - static_cast<std::ptrdiff_t>(loops_waiting), loops.end(),
                     [&](const Loop& loop) { return misfit(loop) > kTellsSomething; });
}

void PoseGraph::State::begin_batch() {
  held[past.end()] = true;  // the batch's own past will end there, and be what comes before it here
  path_at_batch_m = chain.path_m(poses.size() - 1);
  under_way.emplace(*this, kNearlyConverged, launch);
}

bool PoseGraph::batch_is_ready() const {
  const State& s = *state_;
  if (!s.under_way || size() == s.under_way->keyframes()) return false;
  const double begun_m = s.under_way->path_m();
  return path_m(size() - 1) - begun_m >= s.options.batch_takes * begun_m;
}

/// Values of a batch's solution, of those variables that the graph still has; what it has got since stays, keyframes
/// where their poses are.
void PoseGraph::State::take_over(gtsam::Values& solution) {
  for (const gtsam::Key key : solution.keys()) {
    if (!values.exists(key)) solution.erase(key);
  }
  for (const auto& [key, value] : values) {
    if (solution.exists(key)) continue;
    is_keyframe(key) ? solution.insert(key, to_gtsam(poses[key])) : solution.insert(key, value);
  }
  values.swap(solution);
}

void PoseGraph::State::adopt(BackgroundBatch::Solution solution) {
  const std::size_t newest = solution.poses.size() - 1;
  const Pose T_correction = solution.poses[newest] * poses[newest].inverse();
  for (std::size_t k = newest + 1; k < poses.size(); ++k) solution.poses.push_back(T_correction * poses[k]);
  poses = std::move(solution.poses);
  take_over(solution.values);
  past = std::move(solution.past);
  for (std::size_t l = 0; l < solution.loops_on.size(); ++l) {
    if (loops[l].is_on() != solution.loops_on[l]) weigh(loops[l], solution.loops_on[l] ? 1.0 : 0.0);
  }
  ++batches;
  loops_waiting = loops.size() - solution.loops_on.size();
}

OptimizerReport PoseGraph::State::adopt_batch() {
  const Stopwatch watch;
  BackgroundBatch::Solution solution = std::exchange(under_way, std::nullopt)->take();
  OptimizerReport report = solution.report;
  report.waited_ms = watch.elapsed_ms();
  adopt(std::move(solution));
  solve_window();
  report.milliseconds = watch.elapsed_ms();
  return report;
}

OptimizerReport PoseGraph::optimize_recent() {
  State& s = *state_;
  if (batch_is_ready()) return s.adopt_batch();
  std::size_t first = size() - 1;
  while (first > s.past.end() && path_m(size() - 1) - path_m(first) < s.options.window_m) --first;
  const OptimizerReport report = optimize_window(first);
  if (s.batch_is_due()) s.begin_batch();
  return report;
}

}  // namespace demslam

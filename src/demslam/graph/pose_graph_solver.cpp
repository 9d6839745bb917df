#include <algorithm>
#include <functional>
#include <numeric>

#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

constexpr double kShortestBatchPath_m = 20.0;  // between two batches in the run
constexpr double kNearlyConverged = 1e-4;      // a batch in the run is followed by others

}  // namespace

OptimizerReport PoseGraph::State::batch(double tolerance) {
  check_tied();
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
  ++batches;
  loops_waiting = 0;
  path_at_batch_m = chain.path_m(poses.size() - 1);
  return report;
}

OptimizerReport PoseGraph::optimize() { return state_->batch(State::kConverged); }

OptimizerReport PoseGraph::optimize_window(std::size_t first) {
  State& s = *state_;
  s.check_tied();
  s.past.extend_to(first, s.factors, s.values);
  s.fold_until(first);
  const OptimizerReport report = s.solve(s.options.max_iterations);
  s.note_newest();
  return report;
}

bool PoseGraph::State::batch_is_due() const {
  if (loops_waiting == 0) return false;
  const double path_m = chain.path_m(poses.size() - 1), since_m = path_m - path_at_batch_m;
  if (batches > 0 && since_m < std::max(kShortestBatchPath_m, options.batch_every * path_m)) return false;
  constexpr double kTellsSomething = 12.59;  // chi-square of 6 degrees of freedom, 95 %
  return std::any_of(loops.end() - static_cast<std::ptrdiff_t>(loops_waiting), loops.end(),
                     [&](const Loop& loop) { return misfit(loop) > kTellsSomething; });
}

OptimizerReport PoseGraph::optimize_recent() {
  State& s = *state_;
  if (s.batch_is_due()) return s.batch(kNearlyConverged);
  std::size_t first = size() - 1;
  while (first > s.past.end() && path_m(size() - 1) - path_m(first) < s.options.window_m) --first;
  return optimize_window(first);
}

}  // namespace demslam

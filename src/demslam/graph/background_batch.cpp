#include "demslam/graph/background_batch.h"

#include <tbb/task_arena.h>

#include <utility>

#include "demslam/base/thread_clock.h"
#include "demslam/base/time.h"

namespace demslam {
namespace {

void solve(PoseGraphProblem& problem, double relative_tolerance, BackgroundBatch::Solution& solution) {
  const Stopwatch watch;
  const ThreadCpuStopwatch processor;
  const std::size_t past_end = problem.past.end();
  solution.report = problem.solve_all(relative_tolerance);
  problem.past.extend_to(past_end, problem.factors, problem.values);
  solution.values.swap(problem.values);
  solution.poses = std::move(problem.poses);
  solution.loops_on = problem.loops_on();
  solution.past = std::move(problem.past);
  solution.report.milliseconds = watch.elapsed_ms();
  solution.report.batch_cpu_ms = processor.elapsed_ms();
}

}  // namespace

std::future<void> in_its_own_thread(std::function<void()> batch) {
  return std::async(std::launch::async, std::move(batch));
}

BackgroundBatch::BackgroundBatch(PoseGraphProblem copy, double relative_tolerance, const BatchLauncher& launch)
    : keyframes_(copy.poses.size()),
      path_m_(copy.chain.path_m(copy.poses.size() - 1)),
      solution_(std::make_shared<Solution>()) {
  auto problem = std::make_shared<PoseGraphProblem>(std::move(copy));
  ready_ = launch([problem = std::move(problem), relative_tolerance, solution = solution_]() mutable {
    tbb::task_arena(1).execute([&] { solve(*problem, relative_tolerance, *solution); });
    problem.reset();
  });
}

BackgroundBatch::Solution BackgroundBatch::take() {
  ready_.get();
  return std::move(*solution_);
}

}  // namespace demslam

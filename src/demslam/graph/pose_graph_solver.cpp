#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <cmath>

#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

constexpr double kShortestBatchPath_m = 20.0;  // between two batches in the run
constexpr int kGraduatedIterations = 5;        // of Levenberg-Marquardt, per step of the non-convexity
constexpr double kNoKernel = 0.999999;         // as good as 1
constexpr double kFirstMu = 1e-4, kLastMu = 1e3, kGraduation = 2.0;

/// Truncated least squares in graduated non-convexity: the weight of a squared residual at a control parameter mu.
/// Yang, Antonante, Tzoumas, Carlone: Graduated Non-Convexity for Robust Spatial Perception (2020), equation 14.
double truncated_weight(double squared, double gate, double mu) {
  if (squared >= (mu + 1.0) / mu * gate) return 0.0;
  if (squared <= mu / (mu + 1.0) * gate) return 1.0;
  return std::sqrt(gate * mu * (mu + 1.0) / squared) - mu;
}

}  // namespace

std::size_t PoseGraph::loops() const { return state_->loops.size(); }
bool PoseGraph::loop_is_on(std::size_t loop) const { return state_->loops.at(loop).factor != nullptr; }

std::size_t PoseGraph::add_loop(const RelativePose& measurement) {
  State& s = *state_;
  s.tied.at(measurement.j) = true;
  s.loops.push_back({measurement, nullptr});
  s.weigh(s.loops.back(), 1.0);
  ++s.loops_waiting;
  return s.loops.size() - 1;
}

void PoseGraph::switch_loop(std::size_t loop, bool on) {
  State& s = *state_;
  s.weigh(s.loops.at(loop), on ? 1.0 : 0.0);
  s.loops_waiting = s.loops.size();
}

double PoseGraph::State::misfit(const Loop& loop) const {
  const RelativePose& m = loop.measurement;
  const Vector6d deviation = (m.T_i_j.inverse() * poses[m.i].inverse() * poses[m.j]).log();
  return deviation.dot(m.covariance.ldlt().solve(deviation));
}

void PoseGraph::State::weigh(Loop& loop, double weight) {
  const RelativePose& m = loop.measurement;
  if (loop.factor) factors.remove(loop.factor, std::min(m.i, m.j));
  loop.factor = nullptr;
  if (weight <= 0.0) return;
  const gtsam::SharedNoiseModel gaussian = gtsam::noiseModel::Gaussian::Covariance(m.covariance / weight);
  const auto cauchy = gtsam::noiseModel::mEstimator::Cauchy::Create(options.loop_kernel_sigmas);
  const auto robust = gtsam::noiseModel::Robust::Create(cauchy, gaussian);
  const gtsam::SharedNoiseModel noise = weight == 1.0 ? gtsam::SharedNoiseModel(robust) : gaussian;
  loop.factor = boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(m.i, m.j, to_gtsam(m.T_i_j), noise);
  add(loop.factor);
}

/// Expects the batch to be solved. Returns how many loops have changed sides.
int PoseGraph::State::sort_out_loops() {
  std::vector<double> squared(loops.size());
  std::vector<bool> was_on(loops.size());
  double largest = 0.0;
  bool settled = true;
  const auto look = [&] {
    largest = 0.0;
    for (std::size_t l = 0; l < loops.size(); ++l) largest = std::max(largest, squared[l] = misfit(loops[l]));
  };
  look();
  for (std::size_t l = 0; l < loops.size(); ++l) {
    was_on[l] = loops[l].factor != nullptr;
    settled = settled && was_on[l] == (squared[l] <= options.loop_gate);
  }
  if (settled) return 0;
  for (Loop& loop : loops) weigh(loop, kNoKernel);
  solve(kGraduatedIterations);
  look();
  for (double mu = std::max(kFirstMu, options.loop_gate / (2.0 * largest)); mu < kLastMu; mu *= kGraduation) {
    bool binary = true;
    for (std::size_t l = 0; l < loops.size(); ++l) {
      const double weight = truncated_weight(squared[l], options.loop_gate, mu);
      binary = binary && (weight < 1e-3 || weight > 0.999);
      weigh(loops[l], weight < 1e-3 ? 0.0 : std::min(weight, kNoKernel));
    }
    solve(kGraduatedIterations);
    look();
    if (binary) break;
  }
  int switched = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const bool on = squared[l] <= options.loop_gate;
    switched += on != was_on[l];
    weigh(loops[l], on ? 1.0 : 0.0);
  }
  return switched;
}

OptimizerReport PoseGraph::optimize() {
  State& s = *state_;
  s.check_tied();
  s.past = {};
  OptimizerReport report = s.solve(s.options.max_iterations);
  report.loops_switched = s.sort_out_loops();
  if (report.loops_switched > 0) {
    const OptimizerReport again = s.solve(s.options.max_iterations);
    report.error_after = again.error_after;
    report.iterations += again.iterations;
    report.milliseconds += again.milliseconds;
  }
  report.batch = true;
  ++s.batches;
  s.loops_waiting = 0;
  s.path_at_batch_m = path_m(size() - 1);
  return report;
}

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
  if (s.batch_is_due()) return optimize();
  std::size_t first = size() - 1;
  while (first > s.past.end() && path_m(size() - 1) - path_m(first) < s.options.window_m) --first;
  return optimize_window(first);
}

}  // namespace demslam

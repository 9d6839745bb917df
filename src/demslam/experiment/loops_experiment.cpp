#include "demslam/experiment/loops_experiment.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "demslam/base/random.h"
#include "demslam/geometry/angle.h"
#include "demslam/graph/loop_closure.h"
#include "demslam/graph/odometry_factor.h"

namespace demslam {
namespace {

constexpr double kFixEvery_m = 20.0, kFixSigma_m = 0.5, kFixSigma_deg = 2.0;
constexpr double kLoopSigma_m = 0.03, kLoopSigma_deg = 0.2, kView_m = 5.0;
constexpr std::size_t kOptimiseEvery = 10;  // keyframes

enum Stream : std::uint64_t { kOdometryStream = 1, kFixStream, kLoopStream, kFalseStream };

Matrix6d isotropic(double sigma_deg, double sigma_m) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(sigma_deg * kRadPerDeg), Eigen::Vector3d::Constant(sigma_m);
  return sigma.cwiseAbs2().asDiagonal();
}

Vector6d noise(Random& random, const Matrix6d& covariance) {
  Vector6d white;
  for (double& value : white) value = random.normal();
  return covariance.llt().matrixL() * white;
}

/// Laps on a rolling circle, each lap up to two metres beside the one before.
std::vector<Pose> laps(const LoopsExperiment& e) {
  const double radius_m = e.lap_m / (2.0 * std::numbers::pi);
  std::vector<Pose> poses;
  const auto count = static_cast<std::size_t>(e.laps * e.lap_m / e.step_m);
  for (std::size_t k = 0; k <= count; ++k) {
    const double angle = static_cast<double>(k) * e.step_m / radius_m;
    const double r = radius_m + std::sin(0.37 * angle);
    const double pitch = 0.1 * std::sin(5.0 * angle), roll = 0.08 * std::cos(7.0 * angle);
    poses.emplace_back(rotation_from_rpy(roll, pitch, angle + 0.5 * std::numbers::pi),
                       Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 2.0 * std::sin(5.0 * angle)));
  }
  return poses;
}

std::vector<RelativePose> measured(const std::vector<Pose>& truth, const LoopsExperiment& e, std::uint64_t seed) {
  Random random(seed, kOdometryStream);
  Vector4d systematic;
  systematic[0] = e.odometry.scale_sigma * random.normal();
  for (int n = 1; n < 4; ++n) systematic[n] = e.odometry.rotation_bias_deg_per_m * kRadPerDeg * random.normal();
  std::vector<RelativePose> motions;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const Pose motion = truth[k - 1].inverse() * truth[k];
    const double sqrt_m = std::sqrt(motion.translation().norm());
    const Matrix6d covariance =
        isotropic(e.odometry.rotation_deg_per_sqrt_m * sqrt_m, e.odometry.translation_m_per_sqrt_m * sqrt_m);
    motions.push_back({k - 1, k, corrected(motion, -systematic) * Pose::exp(noise(random, covariance)), covariance});
  }
  return motions;
}

using Pair = std::pair<std::size_t, std::size_t>;

/// Where false loops come from; the body is its own camera.
class Liar {
 public:
  Liar(const LoopsExperiment& e, const std::vector<Pose>& truth, std::uint64_t seed)
      : truth_(truth), sizes_(e.group_sizes), random_(seed, kFalseStream) {
    const double per_keyframe = e.false_loops / static_cast<double>(truth.size() - kFirst);
    random_rate_ = 0.4 * per_keyframe;
    near_rate_ = 0.3 * per_keyframe;
    double mean_size = 0.0;
    for (const int size : sizes_) mean_size += size / static_cast<double>(sizes_.size());
    group_rate_ = 0.3 * per_keyframe / mean_size;
    left_ = e.false_loops;
  }

  /// Those at the newest keyframe: old keyframe and measured T_i_j.
  std::vector<std::pair<std::size_t, Pose>> at(const PoseGraph& graph);

 private:
  struct Group {
    std::size_t i = 0;  ///< seen next
    Pose T_false_true;  ///< where the rover is taken to be, in the map
    int left = 0;
  };
  static constexpr std::size_t kFirst = 60;  // keyframes driven before the first

  int count(double rate) { return static_cast<int>(rate) + (random_.uniform() < rate - std::floor(rate) ? 1 : 0); }
  std::size_t old_keyframe(std::size_t newest) { return random_.index(newest - 40); }
  Pose anywhere_in_view();
  /// An old keyframe's motion to the newest one as the graph sees it, off by this chi-square in a random direction.
  Pose off_by(const PoseGraph& graph, std::size_t i, double chi_square);

  const std::vector<Pose>& truth_;
  std::vector<int> sizes_;
  Random random_;
  double random_rate_ = 0.0, near_rate_ = 0.0, group_rate_ = 0.0;
  int left_ = 0, groups_ = 0;
  std::vector<Group> open_;
};

Pose Liar::anywhere_in_view() {
  Vector6d xi;
  xi << 0.05 * random_.normal(), 0.05 * random_.normal(), 0.3 * random_.normal(), random_.normal(), random_.normal(),
      0.2 * random_.normal();
  return Pose::exp(xi);
}

Pose Liar::off_by(const PoseGraph& graph, std::size_t i, double chi_square) {
  const std::size_t j = graph.size() - 1;
  const Matrix6d total = graph.relative_covariance(i, j) + isotropic(kLoopSigma_deg, kLoopSigma_m);
  Vector6d direction;
  for (double& value : direction) value = random_.normal();
  const Vector6d off = total.llt().matrixL() * (std::sqrt(chi_square) * direction.normalized());
  return graph.T_map_body(i).inverse() * graph.T_map_body(j) * Pose::exp(off);
}

std::vector<std::pair<std::size_t, Pose>> Liar::at(const PoseGraph& graph) {
  const std::size_t j = graph.size() - 1;
  std::vector<std::pair<std::size_t, Pose>> lies;
  if (j < kFirst) return lies;
  const double gate = LoopOptions().gate;
  for (int n = count(random_rate_); n > 0; --n) lies.emplace_back(old_keyframe(j), anywhere_in_view());
  for (int n = count(near_rate_); n > 0; --n) {
    const std::size_t i = old_keyframe(j);
    lies.emplace_back(i, off_by(graph, i, random_.uniform(0.3, 1.5) * gate));
  }
  for (int n = count(group_rate_); n > 0; --n) {
    const std::size_t i = old_keyframe(j);
    const bool within_reach = groups_ % 2 == 0;  // half of them where the graph may just believe it, half anywhere
    const Pose T_i_j = within_reach ? off_by(graph, i, random_.uniform(0.3, 1.5) * gate) : anywhere_in_view();
    open_.push_back(
        {i, truth_[i] * T_i_j * truth_[j].inverse(), sizes_[static_cast<std::size_t>(groups_) % sizes_.size()]});
    ++groups_;
  }
  for (Group& group : open_) {
    const Pose T_i_j = truth_[group.i].inverse() * group.T_false_true * truth_[j];
    lies.emplace_back(group.i++, T_i_j * Pose::exp(noise(random_, isotropic(kLoopSigma_deg, kLoopSigma_m))));
    --group.left;
  }
  std::erase_if(open_, [&](const Group& group) { return group.left == 0 || group.i + 40 > j; });
  if (std::ssize(lies) > left_) lies.resize(static_cast<std::size_t>(left_));
  left_ -= static_cast<int>(lies.size());
  return lies;
}

struct Outcome {
  std::vector<Pose> poses;
  std::vector<LoopResult> accepted;  ///< ever
  std::set<Pair> left, lies;         ///< on at the end; false ones
  int injected = 0, plausible = 0, rejected_later = 0;
};

class LoopsDrive {
 public:
  LoopsDrive(const LoopsExperiment& e, bool anchored, std::uint64_t seed, bool with_lies)
      : truth_(laps(e)),
        odometry_(measured(truth_, e, seed)),
        anchored_(anchored),
        with_lies_(with_lies),
        seed_(seed),
        step_m_(e.step_m),
        liar_(e, truth_, seed),
        fix_random_(seed, kFixStream),
        graph_({.systematic = OdometryErrors().as_states()}),
        loops_({}, Pose(), [this](std::size_t i, std::size_t j, const Pose&) { return view(i, j); }) {}

  Outcome drive();
  const std::vector<Pose>& truth() const { return truth_; }

 private:
  Motion view(std::size_t i, std::size_t j) const;
  void lie();
  void note(const std::vector<LoopResult>& results);

  std::vector<Pose> truth_;
  std::vector<RelativePose> odometry_;
  bool anchored_, with_lies_;
  std::uint64_t seed_;
  double step_m_;
  Liar liar_;
  Random fix_random_;
  PoseGraph graph_;
  LoopClosure loops_;
  Outcome outcome_;
};

Motion LoopsDrive::view(std::size_t i, std::size_t j) const {
  const Pose T_i_j = truth_[i].inverse() * truth_[j];
  if (T_i_j.translation().norm() > kView_m) return {.reason = "too far apart"};
  Random random(Random::mix(Random::mix(seed_) + i) + j, kLoopStream);
  const Matrix6d covariance = isotropic(kLoopSigma_deg, kLoopSigma_m);
  return {.ok = true, .T_a_b = T_i_j * Pose::exp(noise(random, covariance)), .covariance = covariance, .inliers = 100};
}

void LoopsDrive::lie() {
  for (const auto& [i, T_i_j] : liar_.at(graph_)) {
    const Motion motion{
        .ok = true, .T_a_b = T_i_j, .covariance = isotropic(kLoopSigma_deg, kLoopSigma_m), .inliers = 100};
    outcome_.lies.emplace(i, graph_.size() - 1);
    ++outcome_.injected;
    outcome_.plausible += loops_.consider(graph_, i, motion).status == LoopStatus::unconfirmed;
  }
}

void LoopsDrive::note(const std::vector<LoopResult>& results) {
  for (const LoopResult& loop : results) {
    const Pair pair{loop.measurement.i, loop.measurement.j};
    if (loop.status == LoopStatus::accepted) {
      if (outcome_.left.insert(pair).second) outcome_.accepted.push_back(loop);
    } else {
      outcome_.left.erase(pair);
    }
  }
}

Outcome LoopsDrive::drive() {
  const Matrix6d start = isotropic(0.01, 0.01), fix = isotropic(kFixSigma_deg, kFixSigma_m);
  for (std::size_t k = 0; k < truth_.size(); ++k) {
    if (k == 0) {
      graph_.add_keyframe(truth_[0]);
      graph_.add_prior(0, truth_[0], start);
      continue;
    }
    graph_.add_keyframe(graph_.T_map_body(k - 1) * graph_.corrected_odometry(odometry_[k - 1]));
    graph_.add_odometry(odometry_[k - 1]);
    if (anchored_ && k % static_cast<std::size_t>(kFixEvery_m / step_m_) == 0)
      graph_.add_prior(k, truth_[k] * Pose::exp(noise(fix_random_, fix)), fix);
    if (with_lies_) lie();
    const auto results = loops_.close(graph_);
    note(results);
    const bool closed = std::ranges::count(results, LoopStatus::accepted, &LoopResult::status) > 0;
    if (closed || k % kOptimiseEvery == 0 || graph_.batch_is_ready()) graph_.optimize_recent();
  }
  graph_.optimize();
  note(loops_.review(graph_));
  outcome_.rejected_later = loops_.counters().rejected_later;
  for (std::size_t k = 0; k < truth_.size(); ++k) outcome_.poses.push_back(graph_.T_map_body(k));
  return outcome_;
}

double rms_apart(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k].translation() - b[k].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

LoopsRun compare(const LoopsExperiment& e, bool anchored, std::uint64_t seed) {
  LoopsDrive clean_drive(e, anchored, seed, false), drive(e, anchored, seed, true);
  const Outcome clean = clean_drive.drive(), outcome = drive.drive();
  LoopsRun run{.anchored = anchored,
               .seed = seed,
               .ate_clean_m = rms_apart(clean.poses, drive.truth()),
               .ate_m = rms_apart(outcome.poses, drive.truth()),
               .apart_m = rms_apart(clean.poses, outcome.poses),
               .injected = outcome.injected,
               .plausible = outcome.plausible,
               .true_accepted_clean = static_cast<int>(clean.accepted.size()),
               .rejected_later = outcome.rejected_later};
  std::set<Pair> ever;
  for (const LoopResult& loop : outcome.accepted) {
    const Pair pair{loop.measurement.i, loop.measurement.j};
    if (!ever.insert(pair).second) continue;
    const bool is_lie = outcome.lies.contains(pair), is_left = outcome.left.contains(pair);
    ++(is_lie ? run.false_accepted : run.true_accepted);
    (is_lie ? run.false_left : run.true_left) += is_left;
  }
  return run;
}

using Json = nlohmann::ordered_json;

/// Name and place of every figure of a run.
template <class Run, class Visit>
void visit_figures(Run& run, const Visit& visit) {
  visit("anchored", run.anchored);
  visit("seed", run.seed);
  visit("injected", run.injected);
  visit("plausible", run.plausible);
  visit("false_accepted", run.false_accepted);
  visit("false_left", run.false_left);
  visit("true_accepted", run.true_accepted);
  visit("true_left", run.true_left);
  visit("true_accepted_without_false", run.true_accepted_clean);
  visit("rejected_later", run.rejected_later);
  visit("ate_m", run.ate_m);
  visit("ate_without_false_m", run.ate_clean_m);
  visit("apart_m", run.apart_m);
}

Json json_of(const LoopsRun& run) {
  Json json;
  visit_figures(run, [&](const char* name, const auto& value) { json[name] = value; });
  return json;
}

Json inputs_of(const LoopsExperiment& e) {
  return {{"lap_m", e.lap_m},
          {"step_m", e.step_m},
          {"laps", e.laps},
          {"false_loops", e.false_loops},
          {"group_sizes", e.group_sizes},
          {"rotation_deg_per_sqrt_m", e.odometry.rotation_deg_per_sqrt_m},
          {"translation_m_per_sqrt_m", e.odometry.translation_m_per_sqrt_m},
          {"scale_sigma", e.odometry.scale_sigma},
          {"rotation_bias_deg_per_m", e.odometry.rotation_bias_deg_per_m}};
}

LoopsRun finish(const LoopsExperiment& e, bool anchored, std::uint64_t seed, const FinishedRuns* finished) {
  const std::string name = fmt::format("{}_{}", anchored ? "anchored" : "odometry", seed);
  const std::string inputs = inputs_of(e).dump();
  if (const auto earlier = finished != nullptr ? finished->load(name, inputs) : std::nullopt) {
    const Json json = Json::parse(*earlier);
    LoopsRun run;
    visit_figures(run, [&](const char* figure, auto& value) { json.at(figure).get_to(value); });
    return run;
  }
  const LoopsRun run = compare(e, anchored, seed);
  if (finished != nullptr) finished->save(name, inputs, json_of(run).dump());
  return run;
}

}  // namespace

std::vector<LoopsRun> loops_experiment(const LoopsExperiment& experiment, const FinishedRuns* finished,
                                       const Progress& progress) {
  std::vector<LoopsRun> runs;
  const std::size_t total = experiment.anchored.size() * static_cast<std::size_t>(experiment.seeds);
  for (const bool anchored : experiment.anchored) {
    for (int seed = 0; seed < experiment.seeds && !progress.stop_requested(); ++seed) {
      runs.push_back(finish(experiment, anchored, experiment.seed + static_cast<std::uint64_t>(seed), finished));
      progress.report(runs.size(), total);
    }
  }
  return runs;
}

Table loops_table(const std::vector<LoopsRun>& runs) {
  Table table;
  table.title = "Runs with false loop closures against the same runs without; positions, no alignment.";
  table.header = {
      "run",       "false",         "past the gate", "accepted",        "left at the end",    "true accepted",
      "true left", "without false", "ATE [m]",       "ATE without [m]", "estimates apart [m]"};
  for (const LoopsRun& r : runs) {
    table.rows.push_back({fmt::format("{}, seed {}", r.anchored ? "anchored" : "odometry", r.seed),
                          std::to_string(r.injected), std::to_string(r.plausible), std::to_string(r.false_accepted),
                          std::to_string(r.false_left), std::to_string(r.true_accepted), std::to_string(r.true_left),
                          std::to_string(r.true_accepted_clean), fmt::format("{:.3f}", r.ate_m),
                          fmt::format("{:.3f}", r.ate_clean_m), fmt::format("{:.3f}", r.apart_m)});
  }
  return table;
}

std::string loops_json(const std::vector<LoopsRun>& runs) {
  Json all = Json::array();
  for (const LoopsRun& run : runs) all.push_back(json_of(run));
  return all.dump(1) + "\n";
}

}  // namespace demslam

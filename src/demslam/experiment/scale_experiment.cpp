#include "demslam/experiment/scale_experiment.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "demslam/anchoring/anchor.h"
#include "demslam/base/random.h"
#include "demslam/base/thread_clock.h"
#include "demslam/base/time.h"
#include "demslam/graph/loop_closure.h"
#include "demslam/slam/options.h"
#include "demslam/store/map_store.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr double kStartSigma_m = 0.01, kStartSigma_rad = 0.01 * std::numbers::pi / 180.0;
constexpr int kDescriptorWidth = 64;
constexpr std::size_t kReportEvery = 200;  // keyframes
constexpr TimestampNs kPeriod = 1'000'000'000;

Matrix6d start_covariance() {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kStartSigma_rad), Eigen::Vector3d::Constant(kStartSigma_m);
  return sigma.cwiseAbs2().asDiagonal();
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

KeyframeCost cost_of(const std::vector<float>& ms, std::size_t begin, std::size_t end) {
  std::vector<float> part(ms.begin() + static_cast<std::ptrdiff_t>(begin),
                          ms.begin() + static_cast<std::ptrdiff_t>(end));
  if (part.empty()) return {};
  std::sort(part.begin(), part.end());
  const double sum = std::accumulate(part.begin(), part.end(), 0.0);
  return {part[part.size() / 2], part[part.size() * 99 / 100], sum / static_cast<double>(part.size()), part.back()};
}

/// Keyframes all alike: what a front-end would have stored, as large, without its content.
std::shared_ptr<const StereoFeatures> some_features(int count) {
  Random random(1);
  auto features = std::make_shared<StereoFeatures>();
  features->left.descriptors.resize(count, kDescriptorWidth);
  for (float& value : features->left.descriptors.reshaped()) value = static_cast<float>(random.normal());
  features->left.keypoints.assign(static_cast<std::size_t>(count), Eigen::Vector2f(1.0F, 1.0F));
  features->left.scores.assign(static_cast<std::size_t>(count), 0.5F);
  features->disparity_px.assign(static_cast<std::size_t>(count), 10.0F);
  return features;
}

/// The map of one run; removed with it.
class ScaleMap {
 public:
  ScaleMap(fs::path file, int features)
      : file_(std::move(file)), features_(some_features(features)), store_(create(file_)) {}
  ~ScaleMap() {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm", ".lock"}) fs::remove(file_.string() + suffix, ignored);
  }
  ScaleMap(const ScaleMap&) = delete;
  ScaleMap& operator=(const ScaleMap&) = delete;

  void append(const PoseGraph& graph, const std::optional<RelativePose>& odometry, std::size_t moved_from) {
    const std::size_t k = graph.size() - 1;
    KeyframeEntry entry{.keyframe = {k, k, static_cast<TimestampNs>(k) * kPeriod, graph.T_map_body(k), Pose(), ""},
                        .features = features_};
    if (odometry) entry.factors.push_back({.measurement = *odometry});
    entry.frames.push_back({k, entry.keyframe.t_ns, "tracked", k, Pose(), "{}"});
    for (std::size_t m = moved_from; m < k; ++m) entry.T_map_body.emplace_back(m, graph.T_map_body(m));
    store_.append(entry);
  }
  double size_mb() const {
    double bytes = static_cast<double>(fs::file_size(file_));
    if (fs::exists(file_.string() + "-wal")) bytes += static_cast<double>(fs::file_size(file_.string() + "-wal"));
    return 1e-6 * bytes;
  }

 private:
  static MapStore create(const fs::path& file) {
    std::error_code ignored;
    fs::create_directories(file.parent_path(), ignored);
    for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(file.string() + suffix, ignored);
    return MapStore::create(file, {}, {.descriptors = DescriptorCoding::bytes});
  }

  fs::path file_;
  std::shared_ptr<const StereoFeatures> features_;
  MapStore store_;
};

/// The defaults, told of the odometry that is made here.
PoseGraphOptions graph_options() {
  PoseGraphOptions options = SlamOptions().graph;
  options.systematic = OdometryErrors().as_states();
  return options;
}

/// One run under way.
class ScaleRun {
 public:
  ScaleRun(const ScaleExperiment& experiment, const DriveOptions& options)
      : experiment_(experiment),
        drive_(options),
        graph_(graph_options()),
        anchor_(drive_.dem(), SlamOptions().anchoring, Eigen::Vector3d::Zero(), drive_.T_body_left()),
        loops_({}, drive_.T_body_left(),
               [this](std::size_t i, std::size_t j, const Pose&) { return drive_.view(i, j); }) {
    if (experiment.map_folder) map_.emplace(*experiment.map_folder / "scale.db", experiment.features_per_keyframe);
    row_.length_km = 1e-3 * options.length_m;
    row_.seed = options.seed;
    row_.keyframes = drive_.keyframes();
  }

  bool drive(const Progress& progress, std::size_t done, std::size_t total) {
    for (std::size_t k = 0; k < row_.keyframes; ++k) {
      if (progress.stop_requested()) return false;
      advance(k);
      if (k % kReportEvery == 0) progress.report(done + k, total);
    }
    return true;
  }

  ScaleRow finish();

 private:
  void advance(std::size_t k);
  bool optimise();
  void score();

  const ScaleExperiment& experiment_;
  PetalDrive drive_;
  PoseGraph graph_;
  DemAnchor anchor_;
  LoopClosure loops_;
  std::optional<ScaleMap> map_;
  ScaleRow row_;
  std::vector<float> solver_ms_, store_ms_;
  std::vector<Eigen::Vector3f> when_newest_;  ///< positions
  Pose T_dead_reckoned_;
  double since_optimised_m_ = 0.0, odometry_sum_ = 0.0, run_sum_ = 0.0;
};

/// True when everything may have moved.
bool ScaleRun::optimise() {
  const OptimizerReport report = graph_.optimize_recent();
  since_optimised_m_ = 0.0;
  if (!report.batch) return false;
  ++row_.batches;
  row_.batches_ms += report.batch_cpu_ms;
  row_.waited_ms += report.waited_ms;
  row_.longest_batch_ms = std::max(row_.longest_batch_ms, report.batch_cpu_ms);
  row_.longest_wait_ms = std::max(row_.longest_wait_ms, report.waited_ms);
  return true;
}

void ScaleRun::advance(std::size_t k) {
  const Pose truth = drive_.truth(k);
  const std::optional<RelativePose> odometry = k == 0 ? std::nullopt : std::optional(drive_.odometry(k));
  KeyframeLandmarks landmarks = drive_.landmarks(k);
  std::size_t moved_from = k;
  const ThreadCpuStopwatch solver;
  if (!odometry) {
    graph_.add_keyframe(truth);
    graph_.add_prior(0, truth, start_covariance());
    T_dead_reckoned_ = truth;
  } else {
    graph_.add_keyframe(graph_.T_map_body(k - 1) * graph_.corrected_odometry(*odometry));
    graph_.add_odometry(*odometry);
    T_dead_reckoned_ = T_dead_reckoned_ * odometry->T_i_j;
    since_optimised_m_ += odometry->T_i_j.translation().norm();
  }
  if (!landmarks.points.empty()) anchor_.add_landmarks(std::move(landmarks));
  anchor_.update(graph_);
  const auto loops = loops_.close(graph_);
  const bool closed = std::ranges::count(loops, LoopStatus::accepted, &LoopResult::status) > 0;
  if (closed || since_optimised_m_ >= experiment_.optimise_every_m || graph_.batch_is_ready()) {
    const bool batch = optimise();
    const std::size_t window = static_cast<std::size_t>(PoseGraphOptions{}.window_m / experiment_.drive.step_m);
    moved_from = batch ? 0 : k - std::min(k, window);
  }
  solver_ms_.push_back(static_cast<float>(solver.elapsed_ms()));
  const ThreadCpuStopwatch store;
  if (map_) map_->append(graph_, odometry, moved_from);
  store_ms_.push_back(static_cast<float>(store.elapsed_ms()));
  const Eigen::Vector3d newest = graph_.T_map_body(k).translation();
  when_newest_.push_back(newest.cast<float>());
  run_sum_ += (newest - truth.translation()).squaredNorm();
  odometry_sum_ += (T_dead_reckoned_.translation() - truth.translation()).squaredNorm();
}

void ScaleRun::score() {
  std::vector<std::size_t> all(row_.keyframes);
  std::iota(all.begin(), all.end(), 0U);
  const ThreadCpuStopwatch watch;
  const std::vector<Matrix6d> covariances = graph_.covariances(all);
  row_.covariances_ms = watch.elapsed_ms();
  const double n = static_cast<double>(row_.keyframes);
  double final_sum = 0.0, moved_sum = 0.0;
  for (const std::size_t k : all) {
    const Pose& T_map_body = graph_.T_map_body(k);
    const Eigen::Vector3d error = T_map_body.inverse() * drive_.truth(k).translation();  // in the body
    const Eigen::Matrix3d of_position = covariances[k].bottomRightCorner<3, 3>();
    row_.nees += error.dot(of_position.ldlt().solve(error)) / (3.0 * n);
    final_sum += error.squaredNorm();
    moved_sum += (T_map_body.translation() - when_newest_[k].cast<double>()).squaredNorm();
  }
  row_.ate_final_m = std::sqrt(final_sum / n);
  row_.run_to_final_m = std::sqrt(moved_sum / n);
  row_.ate_run_m = std::sqrt(run_sum_ / n);
  row_.ate_odometry_m = std::sqrt(odometry_sum_ / n);
}

ScaleRow ScaleRun::finish() {
  const std::size_t n = solver_ms_.size(),
                    km = std::min(n, static_cast<std::size_t>(1000.0 / experiment_.drive.step_m));
  row_.all = cost_of(solver_ms_, 0, n);
  row_.first_km = cost_of(solver_ms_, 0, km);
  row_.last_km = cost_of(solver_ms_, n - km, n);
  const KeyframeCost store = cost_of(store_ms_, 0, n);
  row_.store_median_ms = store.median_ms;
  row_.store_longest_ms = store.longest_ms;
  if (map_) row_.map_mb_per_km = map_->size_mb() / row_.length_km;
  const ThreadCpuStopwatch batch;
  graph_.optimize();
  row_.final_batch_ms = batch.elapsed_ms();
  loops_.review(graph_);
  row_.variables = graph_.variables();
  row_.loops_accepted = loops_.counters().accepted;
  row_.loops_off = loops_.counters().rejected_later;
  score();
  row_.peak_memory_mb = peak_memory_mb();
  return row_;
}

using Json = nlohmann::ordered_json;

/// Name and place of every figure of a row.
template <class Row, class Visit>
void visit_figures(Row& row, const Visit& visit) {
  const auto cost = [&](const std::string& part, auto& c) {
    visit(part + "_median_ms", c.median_ms);
    visit(part + "_p99_ms", c.p99_ms);
    visit(part + "_mean_ms", c.mean_ms);
    visit(part + "_longest_ms", c.longest_ms);
  };
  visit("length_km", row.length_km);
  visit("seed", row.seed);
  visit("keyframes", row.keyframes);
  visit("variables", row.variables);
  cost("all", row.all);
  cost("first_km", row.first_km);
  cost("last_km", row.last_km);
  visit("store_median_ms", row.store_median_ms);
  visit("store_longest_ms", row.store_longest_ms);
  visit("batches", row.batches);
  visit("longest_batch_ms", row.longest_batch_ms);
  visit("batches_ms", row.batches_ms);
  visit("longest_wait_ms", row.longest_wait_ms);
  visit("waited_ms", row.waited_ms);
  visit("final_batch_ms", row.final_batch_ms);
  visit("covariances_ms", row.covariances_ms);
  visit("loops_accepted", row.loops_accepted);
  visit("loops_off", row.loops_off);
  visit("peak_memory_mb", row.peak_memory_mb);
  visit("map_mb_per_km", row.map_mb_per_km);
  visit("ate_odometry_m", row.ate_odometry_m);
  visit("ate_run_m", row.ate_run_m);
  visit("ate_final_m", row.ate_final_m);
  visit("nees", row.nees);
  visit("run_to_final_m", row.run_to_final_m);
}

Json json_of(const ScaleRow& row) {
  Json json;
  visit_figures(row, [&](const std::string& name, const auto& value) { json[name] = value; });
  return json;
}

ScaleRow row_of(const std::string& text) {
  const Json json = Json::parse(text);
  ScaleRow row;
  visit_figures(row, [&](const std::string& name, auto& value) { json.at(name).get_to(value); });
  return row;
}

Json inputs_of(const ScaleExperiment& e) {
  return {{"step_m", e.drive.step_m},
          {"world_m", e.drive.world_m},
          {"dem_noise_rms_m", e.drive.noise_rms_m},
          {"dem_noise_length_m", e.drive.noise_length_m},
          {"landmarks", e.drive.landmarks},
          {"landmarks_every_m", e.drive.landmarks_every_m},
          {"optimise_every_m", e.optimise_every_m},
          {"map", e.map_folder.has_value()},
          {"features_per_keyframe", e.features_per_keyframe}};
}

std::vector<DriveOptions> drives_of(const ScaleExperiment& experiment) {
  std::vector<DriveOptions> drives;
  for (const double length_km : experiment.lengths_km) {
    for (int seed = 0; seed < experiment.seeds; ++seed) {
      drives.push_back(experiment.drive);
      drives.back().length_m = 1e3 * length_km;
      drives.back().seed += static_cast<std::uint64_t>(seed);
    }
  }
  return drives;
}

std::size_t keyframes_of(const DriveOptions& drive) { return static_cast<std::size_t>(drive.length_m / drive.step_m); }

}  // namespace

std::vector<ScaleRow> scale_experiment(const ScaleExperiment& experiment, const FinishedRuns* finished,
                                       const Progress& progress) {
  // No helpers: what a keyframe costs is on the run's own thread, and what a batch costs on that of the batch.
  const tbb::global_control no_helpers(tbb::global_control::max_allowed_parallelism, 1);
  std::size_t total = 0, done = 0;
  for (const DriveOptions& drive : drives_of(experiment)) total += keyframes_of(drive);
  std::vector<ScaleRow> rows;
  for (const DriveOptions& drive : drives_of(experiment)) {
    const std::string name = fmt::format("{:g}km_{}", 1e-3 * drive.length_m, drive.seed);
    const std::string inputs = inputs_of(experiment).dump();
    if (const auto earlier = finished != nullptr ? finished->load(name, inputs) : std::nullopt) {
      rows.push_back(row_of(*earlier));
    } else {
      ScaleRun run(experiment, drive);
      if (!run.drive(progress, done, total)) break;
      rows.push_back(run.finish());
      if (finished != nullptr) finished->save(name, inputs, json_of(rows.back()).dump());
    }
    progress.report(done += keyframes_of(drive), total);
  }
  return rows;
}

Table scale_table(const std::vector<ScaleRow>& rows) {
  Table table;
  table.title = "Processor time of the run's own thread per keyframe, memory, map and error over distance; no images.";
  table.header = {"km",
                  "keyframes",
                  "median [ms]",
                  "p99 [ms]",
                  "mean [ms]",
                  "first km: mean [ms]",
                  "last km: mean [ms]",
                  "first km: p99 [ms]",
                  "last km: p99 [ms]",
                  "longest [ms]",
                  "batches",
                  "longest batch [s]",
                  "all batches [s]",
                  "waited for them [s]",
                  "final batch [s]",
                  "covariances [s]",
                  "variables",
                  "loops",
                  "peak [MB]",
                  "map [MB/km]",
                  "odometry ATE [m]",
                  "ATE in the run [m]",
                  "ATE [m]",
                  "NEES / 3"};
  for (const ScaleRow& r : rows) {
    table.rows.push_back({fmt::format("{:g}", r.length_km),
                          std::to_string(r.keyframes),
                          fmt::format("{:.3f}", r.all.median_ms),
                          fmt::format("{:.1f}", r.all.p99_ms),
                          fmt::format("{:.2f}", r.all.mean_ms),
                          fmt::format("{:.2f}", r.first_km.mean_ms),
                          fmt::format("{:.2f}", r.last_km.mean_ms),
                          fmt::format("{:.1f}", r.first_km.p99_ms),
                          fmt::format("{:.1f}", r.last_km.p99_ms),
                          fmt::format("{:.0f}", r.all.longest_ms),
                          std::to_string(r.batches),
                          fmt::format("{:.2f}", 1e-3 * r.longest_batch_ms),
                          fmt::format("{:.1f}", 1e-3 * r.batches_ms),
                          fmt::format("{:.1f}", 1e-3 * r.waited_ms),
                          fmt::format("{:.2f}", 1e-3 * r.final_batch_ms),
                          fmt::format("{:.2f}", 1e-3 * r.covariances_ms),
                          std::to_string(r.variables),
                          std::to_string(r.loops_accepted),
                          fmt::format("{:.0f}", r.peak_memory_mb),
                          fmt::format("{:.1f}", r.map_mb_per_km),
                          fmt::format("{:.1f}", r.ate_odometry_m),
                          fmt::format("{:.2f}", r.ate_run_m),
                          fmt::format("{:.2f}", r.ate_final_m),
                          fmt::format("{:.2f}", r.nees)});
  }
  return table;
}

std::string scale_json(const std::vector<ScaleRow>& rows) {
  Json all = Json::array();
  for (const ScaleRow& row : rows) all.push_back(json_of(row));
  return all.dump(1) + "\n";
}

}  // namespace demslam

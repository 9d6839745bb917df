#include "demslam/experiment/terrain_experiment.h"

#include <algorithm>
#include <optional>

#include "demslam/evaluation/nees.h"
#include "demslam/experiment/parallel.h"
#include "demslam/experiment/spread.h"

namespace demslam {
namespace {

using Scores = std::vector<EstimateScore>;
using Figure = double EstimateScore::*;

Spread spread(const Scores& scores, Figure figure) {
  std::vector<double> values;
  for (const EstimateScore& score : scores) values.push_back(score.*figure);
  return spread_of(std::move(values));
}

double mean(const Scores& scores, Figure figure) {
  double sum = 0.0;
  for (const EstimateScore& score : scores) sum += score.*figure;
  return sum / static_cast<double>(scores.size());
}

ExperimentRow row_of(const std::string& scene, const std::string& estimator, const Scores& scores) {
  const double freedom = 3.0 * static_cast<double>(scores.size());
  return {.scene = scene,
          .estimator = estimator,
          .seeds = static_cast<int>(scores.size()),
          .median_ate_m = spread(scores, &EstimateScore::ate_m).median,
          .worst_ate_m = spread(scores, &EstimateScore::ate_m).worst,
          .median_horizontal_m = spread(scores, &EstimateScore::horizontal_m).median,
          .median_vertical_m = spread(scores, &EstimateScore::vertical_m).median,
          .median_end_m = spread(scores, &EstimateScore::end_m).median,
          .mean_nees = mean(scores, &EstimateScore::nees),
          .median_nees = spread(scores, &EstimateScore::nees).median,
          .worst_nees = spread(scores, &EstimateScore::nees).worst,
          .nees_low = chi_square_quantile(0.025, freedom) / freedom,
          .nees_high = chi_square_quantile(0.975, freedom) / freedom,
          .median_ms_per_keyframe = spread(scores, &EstimateScore::ms_per_keyframe).median};
}

/// One scene with one seed, and what came out.
struct Job {
  TerrainScene scene;
  ScoresByEstimator scores;
};

std::vector<Job> jobs_of(const TerrainExperiment& experiment) {
  std::vector<Job> jobs;
  for (const TerrainScene& scene : experiment.scenes) {
    for (int i = 0; i < experiment.seeds; ++i) {
      jobs.push_back({scene, {}});
      jobs.back().scene.traverse.seed = experiment.first_seed + static_cast<std::uint64_t>(i);
    }
  }
  return jobs;
}

/// The estimators that the store does not know yet, on a traverse made for them.
void finish(Job& job, const TerrainExperiment& experiment, const SeedStore* store, const Progress& progress) {
  if (store != nullptr) job.scores = store->load(job.scene);
  std::optional<Traverse> traverse;
  for (const Estimator& estimator : experiment.estimators) {
    if (job.scores.contains(estimator.name)) continue;
    if (progress.stop_requested()) return;
    if (!traverse) traverse = make_traverse(job.scene.traverse);
    job.scores[estimator.name] = estimate(*traverse, estimator);
    if (store != nullptr) store->save(job.scene, job.scores);
  }
}

Scores scores_of(const std::vector<Job>& jobs, const std::string& scene, const std::string& estimator) {
  Scores scores;
  for (const Job& job : jobs) {
    const auto score = job.scores.find(estimator);
    if (job.scene.name == scene && score != job.scores.end()) scores.push_back(score->second);
  }
  return scores;
}

}  // namespace

std::vector<ExperimentRow> terrain_experiment(const TerrainExperiment& experiment, const SeedStore* store,
                                              const Progress& progress) {
  std::vector<Job> jobs = jobs_of(experiment);
  for_each_in_parallel(jobs.size(), experiment.threads, progress,
                       [&](std::size_t i) { finish(jobs[i], experiment, store, progress); });
  std::vector<ExperimentRow> rows;
  for (const TerrainScene& scene : experiment.scenes) {
    for (const Estimator& estimator : experiment.estimators) {
      const Scores scores = scores_of(jobs, scene.name, estimator.name);
      if (!scores.empty()) rows.push_back(row_of(scene.name, estimator.name, scores));
    }
  }
  return rows;
}

}  // namespace demslam

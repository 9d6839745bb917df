#include "demslam/experiment/terrain_experiment.h"

#include <fmt/format.h>

#include <algorithm>

namespace demslam {
namespace {

using Scores = std::vector<EstimateScore>;
using Figure = double EstimateScore::*;

std::vector<double> sorted(const Scores& scores, Figure figure) {
  std::vector<double> values;
  for (const EstimateScore& score : scores) values.push_back(score.*figure);
  std::sort(values.begin(), values.end());
  return values;
}

double median(const Scores& scores, Figure figure) {
  const std::vector<double> values = sorted(scores, figure);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

ExperimentRow row_of(const std::string& name, const Scores& scores) {
  return {.estimator = name,
          .median_ate_m = median(scores, &EstimateScore::ate_m),
          .worst_ate_m = sorted(scores, &EstimateScore::ate_m).back(),
          .median_horizontal_m = median(scores, &EstimateScore::horizontal_m),
          .median_vertical_m = median(scores, &EstimateScore::vertical_m),
          .median_end_m = median(scores, &EstimateScore::end_m),
          .median_nees = median(scores, &EstimateScore::nees),
          .worst_nees = sorted(scores, &EstimateScore::nees).back(),
          .median_ms_per_keyframe = median(scores, &EstimateScore::ms_per_keyframe)};
}

}  // namespace

std::vector<ExperimentRow> terrain_experiment(const TerrainExperiment& experiment, const Progress& progress) {
  std::vector<Scores> scores(experiment.estimators.size());
  for (int seed = 0; seed < experiment.seeds && !progress.stop_requested(); ++seed) {
    TraverseOptions options = experiment.traverse;
    options.seed += static_cast<std::uint64_t>(seed);
    const Traverse traverse = make_traverse(options);
    for (std::size_t e = 0; e < scores.size(); ++e) scores[e].push_back(estimate(traverse, experiment.estimators[e]));
    progress.report(static_cast<std::size_t>(seed + 1), static_cast<std::size_t>(experiment.seeds));
  }
  std::vector<ExperimentRow> rows;
  for (std::size_t e = 0; e < scores.size(); ++e) {
    if (!scores[e].empty()) rows.push_back(row_of(experiment.estimators[e].name, scores[e]));
  }
  return rows;
}

std::string markdown_table(const std::vector<ExperimentRow>& rows) {
  std::string table =
      "| estimator | ATE median [m] | worst [m] | horizontal [m] | vertical [m] | end [m] | NEES median | worst | ms "
      "per keyframe |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const ExperimentRow& r : rows) {
    table += fmt::format("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |\n",
                         r.estimator, r.median_ate_m, r.worst_ate_m, r.median_horizontal_m, r.median_vertical_m,
                         r.median_end_m, r.median_nees, r.worst_nees, r.median_ms_per_keyframe);
  }
  return table;
}

}  // namespace demslam

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/evaluation/table.h"
#include "demslam/experiment/estimator.h"
#include "demslam/experiment/seed_store.h"
#include "demslam/experiment/terrain_scenes.h"

namespace demslam {

/// Scenes, each driven over many worlds by every estimator.
struct TerrainExperiment {
  std::vector<TerrainScene> scenes = terrain_scenes();
  std::vector<Estimator> estimators = terrain_estimators();
  int seeds = 10;
  std::uint64_t first_seed = 1;
  int threads = 2;  ///< seeds at the same time; the results do not depend on it
};

/// One estimator in one scene over all seeds; errors unaligned.
struct ExperimentRow {
  std::string scene, estimator;
  int seeds = 0;
  double median_ate_m = 0.0, worst_ate_m = 0.0;
  double median_horizontal_m = 0.0, median_vertical_m = 0.0, median_end_m = 0.0;
  double mean_nees = 0.0, median_nees = 0.0, worst_nees = 0.0;  ///< per degree of freedom
  double nees_low = 0.0, nees_high = 0.0;                       ///< 95 % band of the mean over as many independent runs
  double median_ms_per_keyframe = 0.0;                          ///< wall clock; zero for seeds of an earlier process
};

/// One row per scene and estimator, in their order. `store`, if any, keeps and gives back finished seeds. When
/// `progress` asks to stop, the rows cover the seeds done so far.
std::vector<ExperimentRow> terrain_experiment(const TerrainExperiment& experiment, const SeedStore* store = nullptr,
                                              const Progress& progress = {});

/// Every figure but the wall-clock ones.
Table experiment_table(const std::vector<ExperimentRow>& rows);
/// Median milliseconds per keyframe.
Table timing_table(const std::vector<ExperimentRow>& rows);
/// First the median error, one row per estimator and one column per scene; then every figure.
std::string experiment_markdown(const std::vector<ExperimentRow>& rows);
std::string experiment_json(const std::vector<ExperimentRow>& rows);

}  // namespace demslam

#pragma once

#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/experiment/estimator.h"

namespace demslam {

/// The same traverse, driven over many worlds by every estimator.
struct TerrainExperiment {
  TraverseOptions traverse;  ///< its seed is the first of the run
  std::vector<Estimator> estimators = {odometry_only(),        published_factors(), full_gradient(),
                                       full_gradient_states(), terrain_patches(),   filtered_patches()};
  int seeds = 10;
};

/// One estimator over all seeds; errors unaligned.
struct ExperimentRow {
  std::string estimator;
  double median_ate_m = 0.0, worst_ate_m = 0.0;
  double median_horizontal_m = 0.0, median_vertical_m = 0.0, median_end_m = 0.0;
  double median_nees = 0.0, worst_nees = 0.0;  ///< per degree of freedom
  double median_ms_per_keyframe = 0.0;         ///< wall clock, the only figures that differ from run to run
};

/// One row per estimator. When `progress` asks to stop, the rows cover the seeds done so far.
std::vector<ExperimentRow> terrain_experiment(const TerrainExperiment& experiment, const Progress& progress = {});

/// The rows as a Markdown table.
std::string markdown_table(const std::vector<ExperimentRow>& rows);

}  // namespace demslam

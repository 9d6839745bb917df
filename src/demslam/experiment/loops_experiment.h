#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/evaluation/table.h"
#include "demslam/experiment/finished_runs.h"
#include "demslam/experiment/traverse.h"

namespace demslam {

/// False loop closures, already verified by the images as far as anybody knows, put into runs that also have true ones.
/// A rover drives laps on a circle; the same run with and without false loops is compared.
struct LoopsExperiment {
  double lap_m = 300.0, step_m = 1.0;
  int laps = 5;  ///< the first one has no true loops
  int seeds = 10;
  int false_loops = 1000;  ///< per run: 40 % random, 30 % near the gate, 30 % in groups that agree
  std::vector<int> group_sizes = {2, 3, 4, 6, 8, 12};  ///< keyframes in a row that take a place for another, in turn
  std::vector<bool> anchored = {false, true};  ///< with an absolute fix (0.5 m, 2 degrees) every 20 m, as a DEM gives
  OdometryErrors odometry;
  std::uint64_t seed = 1;
};

/// One run with false loops against the same run without.
struct LoopsRun {
  bool anchored = false;
  std::uint64_t seed = 0;
  double ate_clean_m = 0.0, ate_m = 0.0;
  double apart_m = 0.0;                    ///< RMS distance between the two estimates
  int injected = 0, plausible = 0;         ///< false ones, and those that passed the gate
  int false_accepted = 0, false_left = 0;  ///< ever, and on at the end
  int true_accepted = 0, true_left = 0, true_accepted_clean = 0;
  int rejected_later = 0;  ///< as the loop closure counts them
};

/// The runs finished when `progress` asks to stop; those that `finished` holds are not made again, new ones are put
/// there.
std::vector<LoopsRun> loops_experiment(const LoopsExperiment& experiment, const FinishedRuns* finished = nullptr,
                                       const Progress& progress = {});

Table loops_table(const std::vector<LoopsRun>& runs);
std::string loops_json(const std::vector<LoopsRun>& runs);

}  // namespace demslam

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "demslam/anchoring/global_fix.h"
#include "demslam/base/progress.h"
#include "demslam/evaluation/table.h"
#include "demslam/experiment/traverse.h"

namespace demslam {

/// How often a search of whole submaps finds the place, and how often it takes a wrong one for it. Every submap of
/// every world is searched for from starts that are wrong by each of `start_errors_m` in a random direction, and, where
/// `global_radius_m` is positive, from no start at all within that radius.
struct FixExperiment {
  std::vector<Relief> reliefs = {Relief::highland, Relief::mid, Relief::mare, Relief::flat};
  TraverseOptions traverse{.length_m = 378.0};
  std::vector<double> start_errors_m = {5.0, 20.0, 50.0};
  double heading_error_deg = 1.0;  ///< standard deviation
  double global_radius_m = 0.0;
  bool foreign = false;  ///< the DEM is another world's: whatever is accepted is wrong
  SubmapOptions submap;
  DemErrorModel dem_error;
  int seeds = 10;
  std::uint64_t first_seed = 1;
  int threads = 2;
};

struct FixRow {
  std::string relief, start;
  int trials = 0, accepted = 0;
  int wrong = 0;                                     ///< accepted, and more than 5 m off or on a foreign DEM
  double median_error_m = 0.0, worst_error_m = 0.0;  ///< horizontal, of the accepted ones
  double mean_nis = 0.0;                             ///< of their horizontal errors, per degree of freedom
};

/// One row per relief and start.
std::vector<FixRow> fix_experiment(const FixExperiment& experiment, const Progress& progress = {});
Table fix_table(const std::vector<FixRow>& rows);

}  // namespace demslam

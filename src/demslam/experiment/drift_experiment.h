#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/evaluation/table.h"
#include "demslam/experiment/frontend_experiment.h"
#include "demslam/experiment/study.h"
#include "demslam/odometry/odometry.h"

namespace demslam {

/// How fast stereo odometry drifts, by front-end and method; no map, no loops, no other sensors.
struct DriftExperiment {
  std::vector<NamedFrontend> frontends;
  std::vector<OdometryMethod> methods = {OdometryMethod::pnp, OdometryMethod::keyframe, OdometryMethod::window};
  std::vector<StudyDrive> drives;  ///< simulated once, with images, in OUT/DRIVE_sSEED/data
  std::vector<std::uint64_t> seeds = {1};
  std::vector<std::filesystem::path> sequences;  ///< real ones, with their truth
};

/// One run. RPE over 10 m of the truth, per metre: what KITTI's odometry benchmark asks for, on a short path; NaN where
/// no two poses 10 m apart were tracked.
struct DriftRow {
  std::string sequence, frontend;
  OdometryMethod method = OdometryMethod::window;
  double completion = 0.0, path_m = 0.0;
  double translation_percent = 0.0, rotation_deg_per_m = 0.0;
  double end_percent = 0.0;  ///< end-point error over the path, unaligned
  double cpu_ms = 0.0;       ///< processor time per frame, images read included
};

/// Runs what `out` does not hold yet: OUT/SEQUENCE/FRONTEND_METHOD. When asked to stop, gives the rows so far; the same
/// call goes on. A run that was there already has no processor time (NaN).
std::vector<DriftRow> drift_experiment(const DriftExperiment& experiment, const std::filesystem::path& out,
                                       const Progress& progress = {});
Table drift_table(const std::vector<DriftRow>& rows);
std::string drift_json(const std::vector<DriftRow>& rows);

}  // namespace demslam

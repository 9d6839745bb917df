#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/dem/perturb.h"
#include "demslam/experiment/spread.h"
#include "demslam/sim/scene.h"
#include "demslam/slam/options.h"

namespace demslam {

/// A simulated drive; its seed is the study's to choose.
struct StudyDrive {
  std::string name;
  SceneOptions scene;
};

/// The map that a variant is given.
enum class StudyDem {
  orbital,  ///< the scene's own product
  ground,   ///< the true ground, averaged over the DEM's cells, with the errors the variant says
  lidar     ///< cells of a metre, gathered by the rover's LiDAR at its true poses (sim/surveyed_ground.h)
};

/// One way to solve the same images.
struct StudyVariant {
  std::string name;  ///< of its run folder and its row
  SlamOptions options;
  StudyDem dem = StudyDem::orbital;
  Perturbation errors = {};  ///< of StudyDem::ground
};

/// Drives with images, each solved by every variant. The odometry runs once per drive, with the first variant's
/// front-end and odometry options; the others solve what it has recorded.
struct Study {
  std::string name, title;
  std::vector<StudyDrive> drives;
  std::vector<StudyVariant> variants;
  std::vector<std::uint64_t> seeds = {1};
  bool keep_recordings = false;  ///< with the features of every keyframe: large, and all that another variant needs
};

/// Errors of one run, RMSE without alignment, metres.
struct StudyScore {
  std::string drive, variant;
  std::uint64_t seed = 0;
  double path_m = 0.0, completion = 0.0;
  double ate_m = 0.0, horizontal_m = 0.0, vertical_m = 0.0, ate_star = 0.0, drift_percent = 0.0;
  double rpe_m = 0.0;  ///< over one frame
  double nees = 0.0;   ///< of the position; 3 is consistent
  int loops = 0;
};

/// Where a study keeps one drive with one seed: data, recording, and a run folder per variant.
std::filesystem::path study_folder(const std::filesystem::path& out, const StudyDrive& drive, std::uint64_t seed);

/// Simulates, runs and evaluates what `out` does not hold yet: OUT/DRIVE_sSEED/data (no images; they are rendered as
/// they are read) and OUT/DRIVE_sSEED/VARIANT (run folders). When asked to stop, gives the scores so far; the same call
/// goes on.
std::vector<StudyScore> run_study(const Study& study, const std::filesystem::path& out, const Progress& progress);

using StudyFigure = double StudyScore::*;
/// Over all drives and seeds of `variant`, or those of one drive.
std::optional<Spread> spread_of(const std::vector<StudyScore>& scores, const std::string& variant, StudyFigure figure,
                                const std::string& drive = "");

}  // namespace demslam

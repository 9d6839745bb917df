#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/experiment/study.h"

namespace demslam {

/// A figure of A. Dai, A. Casadesus Vila, G. Gao, "Visual SLAM with DEM Anchoring for Lunar Surface Navigation", IEEE
/// Aerospace 2026, beside which a row of ours is put. Negative: not stated there.
struct PublishedRow {
  std::string drive, variant;
  double ate_m = -1.0, ate_star = -1.0, rpe_m = -1.0, drift_percent = -1.0;
};

/// An experiment of the publication, on our simulator.
struct PublishedExperiment {
  Study study;
  std::vector<PublishedRow> published;
};

/// How much of it: `seeds` of everything random; coarser frames; `quick`: 40 m of small images, for a table in minutes.
struct ExperimentExtent {
  int seeds = 1;       ///< worlds per scene
  int first_seed = 1;  ///< of consecutive ones
  bool quick = false;
  double frame_spacing_m = 0.0;  ///< 0: the preset's
  int size_px = 0;               ///< width and height of the images; 0: the preset's
};

std::vector<std::uint64_t> seeds_of(const ExperimentExtent& extent);

// Scenes come from the preset files in `configs` (the repository's configs/ folder, or the installed one).

/// Table 1: nine LuSNAR-like scenes, odometry, published factors, everything; on an orbital product, and on the map
/// that the rover's LiDAR gathers, as published.
PublishedExperiment lusnar_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// The loop of 1.03 km around a crater rim: loop closure at its end alone, and with the DEM.
PublishedExperiment crater_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// The traverse of 1.19 km.
PublishedExperiment traverse_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// The 11 km with images: odometry, sun sensor, DEM, both.
PublishedExperiment longrange_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// Table 2: 378 m, with the DEM's noise, bias and shift.
PublishedExperiment uncertainty_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// Three drives of 300 m: highland, crater rim, mare.
std::vector<StudyDrive> short_drives(const std::filesystem::path& configs, const ExperimentExtent& extent);
/// These, and one on a real elevation map where `nac` names one: every kind of anchoring.
PublishedExperiment anchoring_experiment(const std::filesystem::path& configs, const ExperimentExtent& extent,
                                         const std::filesystem::path& nac);

}  // namespace demslam

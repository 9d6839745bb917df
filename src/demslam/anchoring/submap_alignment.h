#pragma once

#include <memory>
#include <string>

#include "demslam/anchoring/terrain_search.h"

namespace demslam {

/// How a search decides whether it has found the one place.
struct FixAcceptance {
  double peak_distance_m = 10.0;  ///< every place at least this far from the best one
  double peak_chi_square = 20.0;  ///< must fit worse by this much
  double max_misfit = 0.45;       ///< chi-square per cell at the best place: with the DEM's noise as stated the right
                                  ///< one has 0.2 to 0.3, the best of a DEM that does not show the place 0.5 and more
  double max_noise_scale = 4.0;   ///< a place that stands out and misfits is searched for again in a DEM of twice the
                                  ///< noise, up to so many times what was said; it must stand out there, too
  int min_cells = 20;             ///< of ground
  double max_sigma_m = 5.0;       ///< horizontal, of the result
};

struct SubmapOptions {
  bool recover = false;     ///< search, and move the estimate where the search disagrees with it
  bool factors = false;     ///< every accepted fix becomes a pose factor (instead of patches, not beside them)
  double length_m = 100.0;  ///< of path per submap
  double every_m = 50.0;    ///< of path between searches
  double disagree_m = 4.0;  ///< horizontally; less is left to the other factors
  double step_m = 2.5;      ///< of the search grid
  double min_window_m = 30.0, max_window_m = 150.0, window_sigmas = 3.0;  ///< half the side of the search window
  double min_window_deg = 3.0, max_window_deg = 10.0;                     ///< headings, both ways
  double sigma_tilt_deg = 0.5;                                            ///< roll and pitch as the graph has them
  FixAcceptance acceptance;
};

enum class FixStatus { accepted, too_little_ground, off_the_dem, at_window_edge, ambiguous, misfit, too_vague };

std::string to_string(FixStatus status);

/// What a search says. Where accepted, pose and covariance (of the right perturbation) are mean and spread over the
/// minima of the misfit around the best one, as if nothing had bent the ground; otherwise the best place and its
/// curvature, meaningless when there was too little ground or no DEM.
struct TerrainFix {
  FixStatus status = FixStatus::too_little_ground;
  Pose T_map_body;
  Matrix6d covariance = Matrix6d::Zero();
  double chi_square = 0.0, second_chi_square = 0.0;  ///< at the best place and at the best one far from it
  std::size_t cells = 0;
  double noise_scale = 1.0;  ///< of the DEM's noise that the verdict rests on, over what was said

  bool accepted() const { return status == FixStatus::accepted; }
};

/// Finds the submap on the DEM around `T_map_body`, its keyframe's believed pose with the covariance of its right
/// perturbation, which sets the window.
TerrainFix align_submap(const TerrainPatch& submap, const Pose& T_map_body, const Matrix6d& covariance,
                        std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error,
                        const PatchFactorOptions& factor, const SubmapOptions& options);

/// Ground to look for, on which DEM (as given: the search filters it), and where.
struct SubmapSearch {
  const TerrainPatch& submap;
  Pose T_map_body;  ///< the middle of the window, and the tilt
  std::shared_ptr<const Dem> dem;
  DemErrorModel dem_error;
  PatchFactorOptions factor;
  double sigma_tilt_rad = 0.0;
  SearchWindow window;
};

/// Scans the window, refines the best places, compares, judges.
TerrainFix judged(const SubmapSearch& search, const FixAcceptance& acceptance);

}  // namespace demslam

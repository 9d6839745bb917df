#pragma once

#include <memory>
#include <string>
#include <vector>

#include "demslam/anchoring/anchor.h"
#include "demslam/experiment/traverse.h"

namespace demslam {

/// A way to estimate a traverse: which DEM factors, which states.
struct Estimator {
  std::string name;
  bool anchored = true;
  AnchoringOptions anchoring;
  SystematicOptions systematic;
  bool sun = false;  ///< the measured sun direction, every
  double sun_every_m = 10.0;
  double sun_sigma_deg = 0.3;
  double window_m = 100.0;         ///< path that is optimised while driving
  double optimise_every_m = 10.0;  ///< while driving; a batch over everything closes the run
};

Estimator odometry_only();         ///< its systematic errors as states that nothing tells: they widen the covariance
Estimator published_factors();     ///< height with its vertical Jacobian, normal
Estimator full_gradient();         ///< height and normal with theirs
Estimator full_gradient_states();  ///< gated, and the odometry's systematic errors as states
Estimator terrain_patches();       ///< landmark patches and systematic errors
Estimator filtered_patches();      ///< the same on the Wiener-filtered DEM, gated
Estimator submaps();               ///< whole submaps searched for every 50 m instead of patches
Estimator everything();            ///< filtered patches, states, and a search that brings a lost estimate back
Estimator shipped();               ///< as `demslam run` does by default
Estimator trusting_the_dem();      ///< the same without the DEM's bias and shift as states
Estimator with_sun(Estimator estimator);
std::vector<Estimator> terrain_estimators();  ///< all of these

/// Errors of one estimated traverse, unaligned, over its keyframes.
struct EstimateScore {
  double ate_m = 0.0, horizontal_m = 0.0, vertical_m = 0.0, end_m = 0.0;
  double nees = 0.0;             ///< of the position, divided by its 3 degrees of freedom: 1 is consistent
  double ms_per_keyframe = 0.0;  ///< while driving
  double batch_ms = 0.0;
  AnchoringReport anchoring;
  std::optional<DemShift> dem_shift;
};

/// Drives the estimator along the traverse: windowed optimisation on the way, one batch at the end.
EstimateScore estimate(const Traverse& traverse, const Estimator& estimator);

}  // namespace demslam

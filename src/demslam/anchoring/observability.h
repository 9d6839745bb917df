#pragma once

#include <memory>
#include <vector>

#include "demslam/anchoring/anchor.h"
#include "demslam/base/progress.h"

namespace demslam {

/// What is known of the sensors before a drive.
struct ObservabilityOptions {
  double rotation_deg_per_sqrt_m = 0.015;  ///< odometry's random walk, per axis
  double translation_m_per_sqrt_m = 0.01;
  SystematicOptions systematic{.enabled = true};
  AnchoringOptions anchoring;  ///< the DEM's error, patches and their noise
  double start_sigma_m = 0.1, start_sigma_deg = 0.1;
  double view_m = 25.0;  ///< how far ahead stereo sees ground well enough
  double view_half_angle_deg = 40.0;
  double sigma_cell_m = 0.2;         ///< of a patch cell's height from stereo and from the ground within the cell
  double information_cell_m = 10.0;  ///< cells of the map of information
};

/// Prediction at one place of a route: one standard deviation.
struct PredictedPose {
  double path_m = 0.0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  bool on_dem = true;                                              ///< the DEM has heights here
  double horizontal_m = 0.0, vertical_m = 0.0, heading_deg = 0.0;  ///< when the rover gets there
  double horizontal_after_m = 0.0;                                 ///< when the whole drive is known
  double odometry_horizontal_m = 0.0;                              ///< without the DEM, when it gets there
};

/// Uncertainty along a route (map metres) from the DEM's information content (terrain patches), the odometry's noise
/// and its systematic errors: the covariance of the graph that a rover without any errors would build. One entry per
/// patch length of path. Throws Error when the route is shorter than two of them or begins off the DEM.
std::vector<PredictedPose> predict_along(const std::vector<Eigen::Vector2d>& route, std::shared_ptr<const Dem> dem,
                                         const ObservabilityOptions& options, const Progress& progress = {});

/// Per cell of a coarser raster: the horizontal standard deviation, metres, that one patch of ground around there gives
/// on its own, its height and tilt unknown. No-data where the DEM has holes.
DemRaster predicted_sigma(const Dem& dem, const ObservabilityOptions& options, const Progress& progress = {});

}  // namespace demslam

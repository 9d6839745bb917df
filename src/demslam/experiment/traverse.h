#pragma once

#include <cstdint>
#include <vector>

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/dem/dem.h"
#include "demslam/geometry/pose.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// How good the odometry of a synthetic traverse is: a random walk, and errors that stay the same all along the way.
struct OdometryErrors {
  double rotation_deg_per_sqrt_m = 0.015;   ///< per axis
  double translation_m_per_sqrt_m = 0.01;   ///< per axis
  double scale_sigma = 0.005;               ///< drawn once per traverse
  double rotation_bias_deg_per_m = 0.0007;  ///< standard deviation per body axis, drawn once per traverse

  OdometryErrors times(double factor) const;
  /// What a graph is told of a rig like that.
  SystematicOptions as_states() const { return {.enabled = true, .scale_sigma = scale_sigma}; }
};

/// The orbital map: cell means of the true ground plus correlated noise, of several lengths with equal variances.
struct OrbitalDem {
  double cell_m = 5.0;
  double noise_rms_m = 0.5;
  std::vector<double> noise_lengths_m = {4.0, 12.0, 40.0};  ///< the estimators are not told
  double bias_m = 0.0;
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();
};

struct TraverseOptions {
  Relief relief = Relief::highland;
  double length_m = 378.0;
  bool loop = false;  ///< one circle; otherwise winding lanes, as many as the length needs
  double keyframe_spacing_m = 2.0;
  OdometryErrors odometry;
  OrbitalDem dem;
  int landmarks_per_keyframe = 40;  ///< 3 to 25 m ahead, 3 % of them wrong
  double sun_sigma_deg = 0.3;       ///< of the measured sun direction, per axis
  double start_error_m = 0.0;       ///< the start is believed this far from where it is, in a random direction,
  double start_error_deg = 0.0;     ///< turned by this much; the believed sigmas are as large
  std::uint64_t seed = 1;
};

/// A drive over generated ground without images: what odometry, stereo and an orbiter would have measured, and the
/// truth.
struct Traverse {
  std::vector<Pose> T_map_body;              ///< truth, per keyframe
  std::vector<RelativePose> odometry;        ///< keyframe k-1 to k; covariance of the random walk alone
  std::vector<KeyframeLandmarks> landmarks;  ///< per keyframe
  Eigen::Vector3d sun_map;                   ///< unit vector towards the sun
  std::vector<Eigen::Vector3d> sun_body;     ///< as measured, per keyframe
  Pose T_map_start;                          ///< as believed
  Matrix6d start_covariance;                 ///< of its right perturbation
  Pose T_body_left;
  DemRaster dem;
};

Traverse make_traverse(const TraverseOptions& options);

}  // namespace demslam

#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "demslam/odometry/correspondence.h"
#include "demslam/odometry/vergence.h"

namespace demslam {

/// A point of the scene carried by a patch of its host view. Its pixel there is exact by definition (later views are
/// aligned with that patch), so that its only unknown is the disparity in the host.
struct BundleLandmark {
  int host = 0;
  StereoPixel measured;       ///< in the host
  double disparity_px = 0.0;  ///< the estimate
};

/// A landmark found in another view; d = 0 where it has no disparity there.
struct BundleObservation {
  int landmark = 0, view = 0;
  StereoPixel pixel;
  std::optional<Eigen::Matrix3d> covariance;  ///< of (u, v, d); none: as StereoNoise says
};

/// Stereo bundle adjustment over a few views. View 0 is held fixed.
struct Bundle {
  std::vector<Pose> T_world_left;
  Vergence vergence;          ///< as known without these views; held fixed where that is sure
  double vergence_rad = 0.0;  ///< the estimate
  std::vector<BundleLandmark> landmarks;
  std::vector<BundleObservation> observations;  ///< those of a landmark stand together
};

struct BundleReport {
  bool ok = false;             ///< false when the views do not hang together; the bundle is then unchanged
  Eigen::MatrixXd covariance;  ///< of the right perturbations of views 1, 2, ..., six rows each
  std::vector<bool> inlier;    ///< per observation
  int inliers = 0, iterations = 0;
  double rms_px = 0.0;  ///< of u, v of the inliers
  Vergence vergence;    ///< as known with these views
};

/// Levenberg-Marquardt with the landmarks eliminated (Schur complement) and Cauchy weights. `noise.a` holds the
/// standard deviation of the host's disparity, `noise.b` those of an observation.
BundleReport optimize_bundle(const RectifiedRig& rig, const StereoNoise& noise, Bundle& bundle);

/// Residual of one observation and its Jacobians by the right perturbations of both poses, the disparity in the host
/// and the vergence.
struct BundleError {
  Eigen::Vector3d error;
  Eigen::Matrix<double, 3, 6> by_host, by_view;
  Eigen::Vector3d by_disparity, by_vergence;
  bool in_front = false;
};
BundleError bundle_error(const RectifiedRig& rig, const Pose& T_world_host, const Pose& T_world_view,
                         const StereoPixel& host_pixel, const StereoPixel& view_pixel);

/// Covariance of the right perturbation of T_i_j = T_world_i^-1 T_world_j, i < j.
Matrix6d relative_covariance(const Bundle& bundle, const BundleReport& report, int i, int j);

}  // namespace demslam

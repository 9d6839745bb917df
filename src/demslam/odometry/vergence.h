#pragma once

#include "demslam/geometry/camera.h"

namespace demslam {

/// What the window may find out about the rig. (More of its angles: Hansen, Alismail, Rander, Browning, Online continuous
/// stereo extrinsic parameter estimation, CVPR 2012.)
struct SelfCalibrationOptions {
  bool enabled = true;
  double vergence_sigma_deg = 0.02;              ///< against the calibration
  double vergence_walk_deg_per_sqrt_km = 0.002;  ///< growth of that uncertainty along the path: day, night, vibration
};

/// What is known of RectifiedRig::vergence_rad. A camera turned by 0.01 degrees makes everything at 30 baselines half a
/// percent nearer or farther. Points seen from several places tell: the nearer they come, the less it counts in their
/// depth (the bundle adjustment of odometry/bundle.h).
struct Vergence {
  double rad = 0.0;
  double variance_rad2 = 0.0;  ///< 0: surely

  double sigma_rad() const;
};

/// Before the first image.
Vergence calibrated_vergence(const SelfCalibrationOptions& options);
/// After so much path. What is sure stays so.
Vergence after_path(Vergence known, const SelfCalibrationOptions& options, double path_m);
/// Whether the calibration can be off by that. What is farther away is not a turn that came with cold or vibration: the
/// calibration is another rig's, or something else is wrong that looks like it.
bool plausible(const Vergence& found, const SelfCalibrationOptions& options);
/// Of what lies between a prior and its posterior, a share is taken over: measurements that will be used again and
/// again must not count more than once.
Vergence learned(const Vergence& prior, const Vergence& posterior, double share);

}  // namespace demslam

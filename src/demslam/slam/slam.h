#pragma once

#include "demslam/odometry/odometry.h"
#include "demslam/slam/backend.h"

namespace demslam {

/// The pipeline: one odometry and the back-end behind it. Synchronous and deterministic.
class Slam {
 public:
  /// `dem` may be null; `stored` gives the features of old keyframes back (Backend). Throws Error when the DEM has no
  /// height at the start.
  Slam(const RectifiedRig& rig, Frontend frontend, std::shared_ptr<const Dem> dem, const StartPrior& start,
       const SlamOptions& options, FeatureSource stored = {});

  /// Observations of odometry() in increasing time.
  FrameRecord process(Observation observation);
  /// The last batch optimisation and everything estimated so far.
  SlamResult finish() { return backend_.finish(); }

  StereoOdometry& odometry() { return odometry_; }
  Backend& backend() { return backend_; }

 private:
  StereoOdometry odometry_;
  Backend backend_;
};

}  // namespace demslam

#pragma once

#include "demslam/odometry/odometry.h"
#include "demslam/slam/backend.h"

namespace demslam {

/// The pipeline: one odometry and the back-end behind it. Synchronous and deterministic.
class Slam {
 public:
  /// `dem` may be null. Throws Error when the DEM has no height at the start.
  Slam(const RectifiedRig& rig, Frontend frontend, std::shared_ptr<const Dem> dem, const StartPrior& start,
       const SlamOptions& options);

  /// Rectified pairs in increasing time.
  FrameRecord process(TimestampNs t_ns, const Image& left, const Image& right);
  /// The last batch optimisation and everything estimated so far.
  SlamResult finish() { return backend_.finish(); }

 private:
  StereoOdometry odometry_;
  Backend backend_;
};

}  // namespace demslam

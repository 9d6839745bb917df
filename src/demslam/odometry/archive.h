#pragma once

// State of the odometry as bytes (base/archive.h).

#include "demslam/geometry/archive.h"
#include "demslam/odometry/direct_match.h"
#include "demslam/odometry/odometry.h"

namespace demslam {

template <class Archive>
void archive(Archive& io, PatchPoint& point) {
  io(point.pixel, point.slope);
}

/// A view's name only: features and images are found again from the frame of that time.
inline void archive(ArchiveWriter& io, const StereoView& view) { io(view.t_ns, view.left != nullptr); }

inline void archive(ArchiveReader& io, StereoView& view) {
  bool usable = false;
  io(view.t_ns, usable);
  view.left = usable ? std::make_shared<Image>() : nullptr;
}

template <class Archive>
void archive(Archive& io, Motion& m) {
  io(m.ok, m.reason, m.T_a_b, m.covariance, m.matches, m.inliers, m.rms_px);
}

/// Without features and timings.
template <class Archive>
void archive(Archive& io, OdometryResult& r) {
  io(r.t_ns, r.status, r.reason, r.reference_keyframe, r.T_reference_left, r.covariance, r.is_keyframe, r.keyframe);
  io(r.keypoints, r.stereo_points, r.matches, r.inliers, r.rms_px);
}

}  // namespace demslam

#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/features/frontend.h"
#include "demslam/geometry/camera.h"
#include "demslam/geometry/pose.h"
#include "demslam/image/image.h"
#include "demslam/odometry/dead_reckoning.h"
#include "demslam/odometry/direct_match.h"
#include "demslam/odometry/motion.h"
#include "demslam/odometry/vergence.h"

namespace demslam {

enum class OdometryMethod {
  pnp,       ///< each frame from the one before, by matched keypoints: every frame is a keyframe (as published)
  keyframe,  ///< each frame from the last keyframe, by aligning its patches
  window,    ///< and keyframes refined together by a stereo bundle adjustment over the last few
};

struct OdometryOptions {
  MotionOptions motion;
  OdometryMethod method = OdometryMethod::window;
  int window_keyframes = 7;                 ///< of the bundle adjustment
  SelfCalibrationOptions self_calibration;  ///< in the window
  double keyframe_min_overlap =
      0.5;  ///< new keyframe when fewer than this part of the keyframe's points is still matched
  double keyframe_max_distance_m = 2.0;
  double keyframe_max_rotation_deg = 15.0;
  double max_speed_m_per_s = 30.0;  ///< a faster motion is a jump: refused
  double max_rotation_rate_deg_per_s = 180.0;
  DeadReckoningOptions lost;  ///< how bad frames are bridged
};

enum class Tracking { initialised, tracked, bridged };  ///< bridged: lost; the pose is dead reckoning

struct OdometryTimings {
  double extract_ms = 0.0, stereo_ms = 0.0, motion_ms = 0.0;
};

/// One frame's result. The pose is relative to a keyframe, so that a back-end can move keyframes freely.
struct OdometryResult {
  TimestampNs t_ns = 0;
  Tracking status = Tracking::initialised;
  std::string reason;                  ///< why bridged ("too few inliers (7)", "frozen frame", "dark frame", "jump")
  std::size_t reference_keyframe = 0;  ///< index of the keyframe the motion is measured from
  Pose T_reference_left;               ///< left camera of this frame in the reference keyframe's left camera
  Matrix6d covariance = Matrix6d::Zero();  ///< of its right perturbation
  bool is_keyframe = false;                ///< this frame became keyframe number `keyframe`
  std::size_t keyframe = 0;
  std::shared_ptr<const StereoFeatures> features;  ///< of this frame, their disparities without the vergence
  Vergence vergence;                               ///< as known by now
  int keypoints = 0, stereo_points = 0, matches = 0, inliers = 0;
  double rms_px = 0.0;
  OdometryTimings timings;
};

std::string to_string(Tracking status);
std::string to_string(OdometryMethod method);
/// Of "pnp", "keyframe" or "window"; none of another word.
std::optional<OdometryMethod> odometry_method(std::string_view word);

/// What a pair shows by itself: all the work on a frame that no other frame is needed for.
struct Observation {
  StereoView view;      ///< neither features nor images where there is a problem
  std::string problem;  ///< why the pair shows nothing ("dark frame"); empty: usable
  OdometryTimings timings;
};

/// Rectified.
struct ImagePair {
  Image left, right;
};

/// The pair seen at an earlier time.
using PairSource = std::function<ImagePair(TimestampNs)>;

/// Stereo visual odometry on rectified pairs: extract, match left-right, triangulate, track against the last keyframe,
/// decide on a new keyframe. It never stops on a bad frame: it bridges by dead reckoning, with a covariance that
/// grows with the time lost, starts a new keyframe at the next good frame, and goes on. Knows no DEM and no
/// map.
class StereoOdometry {
 public:
  StereoOdometry(const RectifiedRig& rig, Frontend frontend, const OdometryOptions& options);
  ~StereoOdometry();

  /// May run beside process() of earlier pairs, in one other thread.
  Observation observe(TimestampNs t_ns, Image left, Image right) const;
  /// Observations in increasing time.
  OdometryResult process(Observation observation);
  OdometryResult process(TimestampNs t_ns, Image left, Image right) {
    return process(observe(t_ns, std::move(left), std::move(right)));
  }

  /// What bridges bad frames better than the last velocity.
  void set_sensors(MotionSensors sensors);

  /// Everything that the next frames depend on, but images and features: restore() makes those again from the pairs of
  /// a few earlier frames. It then goes on exactly as the saved one would have.
  std::string save() const;
  void restore(std::string_view saved, const PairSource& pair_at);
  /// Of the last keyframe; null before the first one.
  std::shared_ptr<const StereoFeatures> keyframe_features() const;

  /// As found so far; nothing is learned but by OdometryMethod::window.
  const Vergence& vergence() const;

  /// For loop closure: the same matcher.
  Matcher& matcher();
  const RectifiedRig& rig() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam

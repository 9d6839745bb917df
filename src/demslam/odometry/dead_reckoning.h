#pragma once

#include <vector>

#include "demslam/dataset/sensors.h"
#include "demslam/geometry/pose.h"

namespace demslam {

struct DeadReckoningOptions {
  bool use_imu = true;              ///< the gyroscope, where the dataset has one
  bool use_wheels = true;           ///< where the dataset has them
  double lost_sigma_m_per_s = 0.5;  ///< growth of the uncertainty where only the last velocity goes on
  double lost_sigma_deg_per_s = 5.0;
  double gyro_sigma_deg_per_s = 0.02;  ///< bias
  double wheel_sigma = 0.05;           ///< slip, as a share of the distance
  bool support_weak = true;            ///< a motion that the cameras tell worse than this is fused with it
};

/// What moves the rover's estimate while its cameras see nothing.
struct MotionSensors {
  std::vector<ImuSample> imu;  ///< in the body frame
  std::vector<WheelSample> wheels;
};

/// A relative pose of the left camera and the covariance of its right perturbation.
struct ReckonedStep {
  Pose T_from_to;
  Matrix6d covariance;
};

/// What the cameras saw, held against where dead reckoning gets to. Cameras that tell the translation better than it,
/// in their worst direction, are believed as they are; else both count by their covariances, the cameras' being widened
/// first until the two agree (chi-square of the difference over its 6 degrees of freedom).
ReckonedStep supported(const ReckonedStep& seen, const ReckonedStep& reckoned);

/// Where the rover gets to without cameras: the gyroscope turns it and the wheels move it along its forward axis, each
/// where it covers the time; for the rest its last velocity goes on.
class DeadReckoning {
 public:
  DeadReckoning(const DeadReckoningOptions& options, const Pose& T_body_left)
      : options_(options), T_body_left_(T_body_left) {}

  void set_sensors(MotionSensors sensors) { sensors_ = std::move(sensors); }
  /// `twist_per_s`: last velocity of the left camera, in its own frame.
  ReckonedStep step(TimestampNs from_ns, TimestampNs to_ns, const Vector6d& twist_per_s) const;

 private:
  ReckonedStep by_sensors(TimestampNs from_ns, TimestampNs to_ns, const Vector6d& twist_per_s, bool imu,
                          bool wheels) const;

  DeadReckoningOptions options_;
  Pose T_body_left_;
  MotionSensors sensors_;
};

}  // namespace demslam

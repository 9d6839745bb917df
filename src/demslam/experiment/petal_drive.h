#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/base/random.h"
#include "demslam/dem/dem.h"
#include "demslam/experiment/traverse.h"
#include "demslam/graph/odometry_factor.h"
#include "demslam/odometry/motion.h"

namespace demslam {

/// A route of any length in a square: circles of several radii on both sides of one line, all touching it in the same
/// place, so that every one of them leads back through home in the same direction.
class PetalRoute {
 public:
  PetalRoute(double length_m, double half_size_m);

  /// East, North and heading (radians from East) after this much path.
  Eigen::Vector3d at(double path_m) const;

 private:
  std::vector<double> radii_m_;  ///< signed: left of the line positive
};

struct DriveOptions {
  double length_m = 1000.0;
  double step_m = 0.5;
  double world_m = 10000.0;                         ///< side of the DEM; its cells are a 2,048th of it, 1 m at least
  double noise_rms_m = 0.5, noise_length_m = 10.0;  ///< its error
  OdometryErrors odometry;
  int landmarks = 40;  ///< per keyframe that has any,
  double landmarks_every_m = 2.0;
  double loop_sigma_m = 0.03, loop_sigma_deg = 0.2;
  double view_m = 5.0;  ///< two views nearer than this, and of headings within 40 degrees, match
  std::uint64_t seed = 1;
};

/// What a rover would measure on that route, made as it drives: nothing is held but the DEM. The ground is the DEM
/// without its error.
class PetalDrive {
 public:
  explicit PetalDrive(const DriveOptions& options);

  std::size_t keyframes() const;
  Pose truth(std::size_t keyframe) const;
  /// Motion from the keyframe before; in order, each once.
  RelativePose odometry(std::size_t keyframe);
  /// Ground seen from a keyframe; empty for most of them.
  KeyframeLandmarks landmarks(std::size_t keyframe) const;
  /// What the cameras of two keyframes say of each other.
  Motion view(std::size_t i, std::size_t j) const;
  const std::shared_ptr<const Dem>& dem() const { return measured_; }
  const Pose& T_body_left() const { return T_body_left_; }

 private:
  DriveOptions options_;
  PetalRoute route_;
  Pose T_body_left_;
  std::shared_ptr<const Dem> ground_, measured_;
  Random odometry_random_;
  Vector4d systematic_;
};

}  // namespace demslam

#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <memory>
#include <vector>

#include "demslam/anchoring/skyline.h"

namespace demslam {

/// A direction known in the map and measured in the body: the sun (a sun sensor, its disc or the shadows in an image;
/// the map's direction from an ephemeris), or a star. Two rows, radians: the deviation across the measured direction.
/// With the sun low it tells the heading; the turn about the sun's own direction stays free.
class DirectionFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  /// Unit vectors; `noise` of two rows.
  DirectionFactor(gtsam::Key pose, const Eigen::Vector3d& direction_map, const Eigen::Vector3d& direction_body,
                  const gtsam::SharedNoiseModel& noise);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  Eigen::Vector3d direction_map_;
  Eigen::Matrix<double, 2, 3> across_;  ///< two unit vectors across the measured direction
};

/// The sun's direction (or any) measured to `sigma_deg` per axis, with a Cauchy kernel against glints.
boost::shared_ptr<DirectionFactor> sun_factor(std::size_t keyframe, const Eigen::Vector3d& sun_map,
                                              const Eigen::Vector3d& sun_body, double sigma_deg);

/// The horizon seen in some directions of the body against the DEM's skyline from there. One row per direction: its
/// elevation in the map less the skyline's, radians. Holds the skyline of one place: good as long as the rover stays
/// within a small part of the distance to what makes the horizon.
class SkylineFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  /// Unit vectors towards the horizon; `noise` of as many rows.
  SkylineFactor(gtsam::Key pose, std::shared_ptr<const Skyline> skyline, std::vector<Eigen::Vector3d> directions_body,
                const gtsam::SharedNoiseModel& noise);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  std::shared_ptr<const Skyline> skyline_;
  std::vector<Eigen::Vector3d> directions_body_;
};

/// Noise of `rows` skyline angles that share errors: `sigma_rad` each, of which `effective` are independent.
gtsam::SharedNoiseModel skyline_noise(std::size_t rows, double sigma_rad, double effective, double kernel_sigmas);

}  // namespace demslam

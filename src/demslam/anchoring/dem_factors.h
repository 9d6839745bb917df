#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <memory>

#include "demslam/anchoring/terrain_gradient.h"
#include "demslam/dem/dem.h"
#include "demslam/geometry/pose.h"

namespace demslam {

/// r = p_z - h(p_x, p_y) with p = T_map_body * p_body  (docs/conventions.md, "DEM factors"). `p_body` is the ground
/// contact point or any point known to lie on the terrain. Inactive where the DEM has no value.
class DemHeightFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  DemHeightFactor(gtsam::Key pose, std::shared_ptr<const Dem> dem, const Eigen::Vector3d& p_body,
                  const gtsam::SharedNoiseModel& noise, TerrainGradient gradient = TerrainGradient::full);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  bool active(const gtsam::Values& values) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  std::shared_ptr<const Dem> dem_;
  Eigen::Vector3d p_body_;
  TerrainGradient gradient_;
};

/// The body's up axis against the terrain's normal at the ground point: the smallest rotation that takes one to the
/// other, as a rotation vector in the body, of which only x and y (roll and pitch) can differ from zero. Two rows,
/// heading free. Upside down the axis of that rotation is undefined: half a turn about x is taken, so the residual
/// stays finite. Inactive where the DEM has no value.
class DemNormalFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  DemNormalFactor(gtsam::Key pose, std::shared_ptr<const Dem> dem, const Eigen::Vector3d& p_body_ground,
                  const gtsam::SharedNoiseModel& noise, TerrainGradient gradient = TerrainGradient::full);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  bool active(const gtsam::Values& values) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  std::shared_ptr<const Dem> dem_;
  Eigen::Vector3d p_body_ground_;
  TerrainGradient gradient_;
};

/// d(T_map_body * p_body) by the right perturbation (rotation, translation): [ -R [p]x , R ].
Eigen::Matrix<double, 3, 6> point_jacobian(const gtsam::Pose3& T_map_body, const Eigen::Vector3d& p_body);

}  // namespace demslam

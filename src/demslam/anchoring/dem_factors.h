#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <memory>

#include "demslam/dem/dem.h"

namespace demslam {

/// r = p_z - h(p_x, p_y) with p = T_map_body * b  (mathematics.md, "Height factor"); inactive where the DEM has no value.
class DemHeightFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  DemHeightFactor(gtsam::Key pose, std::shared_ptr<const Dem> dem, const Eigen::Vector3d& p_body_ground,
                  const gtsam::SharedNoiseModel& noise);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  bool active(const gtsam::Values& values) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  std::shared_ptr<const Dem> dem_;
  Eigen::Vector3d p_body_ground_;
};

}  // namespace demslam

#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

namespace demslam {

/// A DEM factor on a DEM that is itself displaced by an unknown vector (East, North, Up): what the factor says at
/// (pose, shift) is what it says at the pose moved along by the shift. Several factors share the shift, which cannot be
/// told from a common error of all positions unless something else is absolute; as a state it carries that doubt into
/// every covariance.
class DemShiftFactor : public gtsam::NoiseModelFactor2<gtsam::Pose3, gtsam::Vector3> {
 public:
  using PoseFactor = gtsam::NoiseModelFactor1<gtsam::Pose3>;

  DemShiftFactor(boost::shared_ptr<const PoseFactor> factor, gtsam::Key shift);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body, const gtsam::Vector3& shift_m,
                              boost::optional<gtsam::Matrix&> H_pose = boost::none,
                              boost::optional<gtsam::Matrix&> H_shift = boost::none) const override;
  bool active(const gtsam::Values& values) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;
  const PoseFactor& on_fixed_dem() const { return *factor_; }

 private:
  boost::shared_ptr<const PoseFactor> factor_;
};

}  // namespace demslam

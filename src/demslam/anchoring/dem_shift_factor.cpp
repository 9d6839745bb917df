#include "demslam/anchoring/dem_shift_factor.h"

#include <boost/make_shared.hpp>
#include <utility>

namespace demslam {
namespace {

gtsam::Pose3 moved_along(const gtsam::Pose3& T_map_body, const gtsam::Vector3& shift_m) {
  return {T_map_body.rotation(), gtsam::Point3(T_map_body.translation() + shift_m)};
}

}  // namespace

DemShiftFactor::DemShiftFactor(boost::shared_ptr<const PoseFactor> factor, gtsam::Key shift)
    : NoiseModelFactor2(factor->noiseModel(), factor->key(), shift), factor_(std::move(factor)) {}

gtsam::Vector DemShiftFactor::evaluateError(const gtsam::Pose3& T_map_body, const gtsam::Vector3& shift_m,
                                            boost::optional<gtsam::Matrix&> H_pose,
                                            boost::optional<gtsam::Matrix&> H_shift) const {
  gtsam::Matrix H;
  const gtsam::Vector error = factor_->evaluateError(moved_along(T_map_body, shift_m), H);
  if (H_shift) *H_shift = H.rightCols<3>() * T_map_body.rotation().matrix().transpose();
  if (H_pose) *H_pose = std::move(H);
  return error;
}

bool DemShiftFactor::active(const gtsam::Values& values) const {
  gtsam::Values pose;
  pose.insert(key1(), moved_along(values.at<gtsam::Pose3>(key1()), values.at<gtsam::Vector3>(key2())));
  return factor_->active(pose);
}

gtsam::NonlinearFactor::shared_ptr DemShiftFactor::clone() const { return boost::make_shared<DemShiftFactor>(*this); }

}  // namespace demslam

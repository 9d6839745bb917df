#include "demslam/anchoring/dem_shift_factor.h"

#include <gtest/gtest.h>
#include <gtsam/base/numericalDerivative.h>
#include <gtsam/inference/Symbol.h>

#include <boost/make_shared.hpp>
#include <functional>

#include "demslam/anchoring/dem_factors.h"
#include "demslam/dem/perturb.h"
#include "demslam/graph/gtsam_pose.h"

namespace demslam {
namespace {

DemRaster ground() {
  DemRaster dem{.rows = 60, .cols = 60, .cell_m = 5.0, .west_m = -150.0, .north_m = 150.0};
  dem.heights.assign(3600, 0.0F);
  return perturb(dem, {.noise_m = {.rms = 4.0, .correlation_length_m = 25.0, .seed = 2}});
}

DemShiftFactor on(const DemRaster& dem) {
  const auto height = boost::make_shared<DemHeightFactor>(
      0, std::make_shared<Dem>(dem), Eigen::Vector3d(1.0, 0.5, -1.5), gtsam::noiseModel::Isotropic::Sigma(1, 0.5));
  return DemShiftFactor(height, gtsam::Symbol('v', 0));
}

const Pose kBody(rotation_from_rpy(0.1, -0.2, 0.7), Eigen::Vector3d(5.0, -8.0, 2.0));

TEST(DemShiftFactor, SaysOnADisplacedDemWithItsShiftWhatItSaysOnTheTrueOne) {
  const Eigen::Vector3d shift(1.5, -2.0, 0.7);
  const DemRaster displaced = perturb(ground(), {.bias_m = shift.z(), .shift_m = shift.head<2>()});
  EXPECT_NEAR(on(displaced).evaluateError(to_gtsam(kBody), shift)[0],
              on(ground()).evaluateError(to_gtsam(kBody), gtsam::Vector3::Zero())[0], 1e-4);
}

TEST(DemShiftFactor, HasItsNumericJacobians) {
  const DemShiftFactor factor = on(ground());
  const gtsam::Vector3 shift(1.0, 2.0, -0.5);
  gtsam::Matrix H_pose, H_shift;
  factor.evaluateError(to_gtsam(kBody), shift, H_pose, H_shift);
  const std::function<gtsam::Vector(const gtsam::Pose3&, const gtsam::Vector3&)> error =
      [&](const gtsam::Pose3& T, const gtsam::Vector3& s) { return factor.evaluateError(T, s); };
  EXPECT_LT((H_pose -
             gtsam::numericalDerivative21<gtsam::Vector, gtsam::Pose3, gtsam::Vector3>(error, to_gtsam(kBody), shift))
                .norm(),
            1e-4);
  EXPECT_LT((H_shift -
             gtsam::numericalDerivative22<gtsam::Vector, gtsam::Pose3, gtsam::Vector3>(error, to_gtsam(kBody), shift))
                .norm(),
            1e-4);
}

}  // namespace
}  // namespace demslam

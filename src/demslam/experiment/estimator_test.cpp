#include "demslam/experiment/estimator.h"

#include <gtest/gtest.h>

namespace demslam {
namespace {

TEST(Estimators, TheMoreOfTheTerrainTheyUseTheBetterTheyKnowWhereTheyAre) {
  const Traverse traverse = make_traverse({.length_m = 378.0, .odometry = OdometryErrors{}.times(3.0), .seed = 3});
  const double odometry_m = estimate(traverse, odometry_only()).ate_m;
  const double patches_m = estimate(traverse, terrain_patches()).ate_m;
  EXPECT_LT(patches_m, 0.3 * odometry_m);
  EXPECT_LT(patches_m, 1.0);
}

}  // namespace
}  // namespace demslam

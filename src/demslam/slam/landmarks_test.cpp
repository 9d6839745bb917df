#include "demslam/slam/landmarks.h"

#include <gtest/gtest.h>

#include "demslam/base/random.h"

namespace demslam {
namespace {

RectifiedRig rig() {
  return {.width = 640, .height = 640, .focal_px = 320.0, .cx = 319.5, .cy = 319.5, .baseline_m = 0.31};
}

StereoFeatures features_at(const std::vector<Eigen::Vector3d>& points) {
  StereoFeatures features;
  for (const Eigen::Vector3d& p : points) {
    features.left.keypoints.push_back(rig().project(p).cast<float>());
    features.disparity_px.push_back(p.z() > 0.0 ? static_cast<float>(rig().disparity_px(p.z())) : 0.0F);
  }
  return features;
}

TEST(GroundLandmarks, AreThePointsWithinTheDepthLimits) {
  const StereoFeatures features = features_at({{0.5, 1.0, 6.0}, {0.1, 0.4, 1.0}, {1.0, 1.0, 60.0}});
  const KeyframeLandmarks landmarks = ground_landmarks(4, rig(), features, {}, {});
  EXPECT_EQ(landmarks.keyframe, 4U);
  ASSERT_EQ(landmarks.points.size(), 1U);
  EXPECT_LT((landmarks.points[0].p_left - Eigen::Vector3d(0.5, 1.0, 6.0)).norm(), 1e-4);
}

TEST(GroundLandmarks, CovarianceIsTheScatterOfNoisyMeasurements) {
  const Eigen::Vector3d p_left(1.0, 1.5, 8.0);
  const MotionOptions noise{.pixel_sigma_px = 0.5, .disparity_sigma_px = 0.1};
  const Eigen::Matrix3d predicted =
      ground_landmarks(0, rig(), features_at({p_left}), noise, {}).points.at(0).covariance;
  Random random(3);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d pixel = rig().project(p_left) + 0.5 * Eigen::Vector2d(random.normal(), random.normal());
    const Eigen::Vector3d error = rig().unproject(pixel, rig().disparity_px(8.0) + 0.1 * random.normal()) - p_left;
    scatter += error * error.transpose() / n;
  }
  EXPECT_LT((scatter - predicted).norm(), 0.05 * predicted.norm());
}

}  // namespace
}  // namespace demslam

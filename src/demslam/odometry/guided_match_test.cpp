#include "demslam/odometry/guided_match.h"

#include <gtest/gtest.h>

#include "demslam/odometry/synthetic_scene.h"

namespace demslam {
namespace {

using namespace testing_scene;

struct Views {
  StereoFeatures a, b;
};

/// The same points in both, in the same order. Every descriptor occurs ten times, so that none is distinct in the whole
/// image.
Views views_of(const Pose& T_a_b) {
  Random random(5);
  const StereoNoise none{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const auto points = random_correspondences(test_rig(), T_a_b, none, 200, random);
  Views views;
  const auto add = [](StereoFeatures& view, const StereoPixel& pixel) {
    view.left.keypoints.push_back(pixel.head<2>().cast<float>());
    view.disparity_px.push_back(static_cast<float>(pixel.z()));
  };
  DescriptorRows rows(200, 32);
  for (int i = 0; i < 200; ++i) {
    add(views.a, points[i].a);
    add(views.b, points[i].b);
    Random look(i % 20, 9);
    for (int c = 0; c < 32; ++c) rows(i, c) = static_cast<float>(look.normal());
  }
  rows.rowwise().normalize();
  views.a.left.descriptors = views.b.left.descriptors = rows;
  return views;
}

int right(const std::vector<Correspondence>& matches, const Pose& T_a_b) {
  int count = 0;
  for (const Correspondence& m : matches) {
    const StereoPixel seen = project(test_rig(), T_a_b.inverse() * unproject(test_rig(), m.a));
    count += (seen - m.b).head<2>().norm() < 0.5;
  }
  return count;
}

TEST(MatchNear, TellsLookAlikesApartByWhereTheyShouldBe) {
  const Pose T_a_b(rotation_from_rpy(0.0, 0.05, 0.0), {0.1, 0.0, 1.5});
  const Pose predicted = T_a_b * Pose(rotation_from_rpy(0.01, 0.01, 0.0), {0.05, 0.0, 0.05});
  const Views views = views_of(T_a_b);
  const auto matches = match_near(test_rig(), views.a, views.b, predicted, 20.0, 0.9);
  EXPECT_GT(right(matches, T_a_b), 120);
  EXPECT_LT(matches.size() - right(matches, T_a_b), 20U);
}

TEST(MatchNear, FindsLittleWhereThePredictionIsWrong) {
  const Pose T_a_b(Eigen::Quaterniond::Identity(), {0.1, 0.0, 1.5});
  const Views views = views_of(T_a_b);
  const Pose wrong = T_a_b * Pose(rotation_from_rpy(0.0, 0.4, 0.0), {0.0, 0.0, 0.0});
  EXPECT_LT(right(match_near(test_rig(), views.a, views.b, wrong, 20.0, 0.9), T_a_b), 10);
}

}  // namespace
}  // namespace demslam

#include "demslam/odometry/disparity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "demslam/features/frontend.h"
#include "demslam/odometry/direct_match.h"
#include "demslam/odometry/patch_align.h"
#include "demslam/odometry/synthetic_scene.h"

namespace demslam {
namespace {

using testing_scene::render_pair;
using testing_scene::T_world_left;
using testing_scene::test_rig;

/// Depth of the plane along the ray of a pixel, in the camera's frame.
double true_depth(const RectifiedRig& rig, const Pose& T_world_camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = rig.unproject(pixel, rig.focal_px * rig.baseline_m);
  return 1.2 / (T_world_camera.rotation() * ray).y();
}

std::vector<Eigen::Vector2f> grid(const RectifiedRig& rig, float spacing_px = 9.5F) {
  std::vector<Eigen::Vector2f> keypoints;
  for (float v = 100.3F; v < static_cast<float>(rig.height) - 20.0F; v += spacing_px) {
    for (float u = 90.6F; u < static_cast<float>(rig.width) - 20.0F; u += spacing_px) keypoints.emplace_back(u, v);
  }
  return keypoints;
}

std::vector<Eigen::Vector2f> detected(const Image& image) {
  FrontendOptions options;
  options.max_features = 400;
  return make_frontend(options).extractor->extract(image).keypoints;
}

struct ErrorStatistics {
  int found = 0;
  double mean = 0.0, rms = 0.0;
};

ErrorStatistics disparity_errors(const RectifiedRig& rig, const Pose& T_world_camera,
                                 const std::vector<Eigen::Vector2f>& keypoints, const Disparities& found) {
  ErrorStatistics errors;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    if (found.disparity_px[i] <= 0.0F) continue;
    const double truth = rig.disparity_px(true_depth(rig, T_world_camera, keypoints[i].cast<double>()));
    const double error = found.disparity_px[i] - truth;
    ++errors.found;
    errors.mean += error;
    errors.rms += error * error;
  }
  errors.mean /= errors.found;
  errors.rms = std::sqrt(errors.rms / errors.found);
  return errors;
}

TEST(FindDisparities, AreUnbiasedAndExactToATenthOfAPixelOnSlantedGround) {
  const RectifiedRig rig = test_rig();
  const Pose pose = T_world_left(0.0, 0.0, 0.1);
  const auto pair = render_pair(rig, pose, 1);
  const auto keypoints = detected(pair.left);
  const auto errors = disparity_errors(rig, pose, keypoints, find_disparities(pair.left, pair.right, keypoints, {}));
  EXPECT_GT(errors.found, 0.6 * keypoints.size());
  EXPECT_LT(std::abs(errors.mean), 0.02);
  EXPECT_LT(errors.rms, 0.12);
}

TEST(FindDisparities, DoNotSufferFromRowsThatAreHalfAPixelOff) {
  const RectifiedRig rig = test_rig();
  const Pose pose = T_world_left(0.0, 0.0, 0.1);
  auto pair = render_pair(rig, pose, 1);
  Image shifted = pair.right;
  for (int v = 0; v + 1 < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      shifted.at(u, v) = static_cast<std::uint8_t>((pair.right.at(u, v) + pair.right.at(u, v + 1) + 1) / 2);
    }
  }
  const auto keypoints = grid(rig);
  const auto errors = disparity_errors(rig, pose, keypoints, find_disparities(pair.left, shifted, keypoints, {}));
  EXPECT_GT(errors.found, 0.8 * keypoints.size());
  EXPECT_LT(std::abs(errors.mean), 0.03);
}

TEST(FindDisparities, KnowTheSlopeOfTheGround) {
  const RectifiedRig rig = test_rig();
  const Pose pose = T_world_left(0.0, 0.0, 0.0);
  const auto pair = render_pair(rig, pose, 1);
  const auto keypoints = grid(rig);
  const Disparities found = find_disparities(pair.left, pair.right, keypoints, {});
  const auto disparity = [&](double u, double v) { return rig.disparity_px(true_depth(rig, pose, {u, v})); };
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    if (found.disparity_px[i] > 0.0F) sum += found.slope[i].y(), ++count;
  }
  EXPECT_NEAR(sum / count, disparity(160.0, 101.0) - disparity(160.0, 100.0), 0.03);
}

TEST(FindDisparities, FindNothingWhereThereIsNothing) {
  const RectifiedRig rig = test_rig();
  const auto keypoints = grid(rig);
  const Image flat(rig.width, rig.height, 90);
  const Image left = render_pair(rig, T_world_left(0.0, 0.0, 0.0), 1).left;
  const Image elsewhere = render_pair(rig, T_world_left(50.0, 80.0, 0.0), 2).right;
  const auto count = [](const Disparities& found) {
    return std::ranges::count_if(found.disparity_px, [](float d) { return d > 0.0F; });
  };
  EXPECT_EQ(count(find_disparities(flat, flat, keypoints, {})), 0);
  EXPECT_LT(count(find_disparities(left, elsewhere, keypoints, {})), 0.05 * keypoints.size());
}

/// What direct matches of the ground make of a known motion: mean and root mean square of (u, v) against the truth.
struct MatchErrors {
  std::size_t found = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double rms = 0.0;
};

MatchErrors direct_match_errors(const Pose& T_world_a, const Pose& T_world_b, const Pose& guess_error) {
  const RectifiedRig rig = test_rig();
  const auto a = render_pair(rig, T_world_a, 3), b = render_pair(rig, T_world_b, 4);
  StereoFeatures features;
  features.left.keypoints = detected(a.left);
  const Disparities found = find_disparities(a.left, a.right, features.left.keypoints, {});
  features.disparity_px = found.disparity_px;
  features.disparity_slope = found.slope;
  const StereoView view_a{std::make_shared<StereoFeatures>(features), std::make_shared<Image>(a.left),
                          std::make_shared<Image>(a.right)};
  const StereoView view_b{std::make_shared<StereoFeatures>(), std::make_shared<Image>(b.left),
                          std::make_shared<Image>(b.right)};
  const Pose T_a_b = T_world_a.inverse() * T_world_b;
  MatchErrors errors;
  for (const Correspondence& c : match_directly(rig, view_a, view_b, T_a_b * guess_error)) {
    const Eigen::Vector2d pixel_a = c.a.head<2>();
    const Eigen::Vector3d p_b =
        T_a_b.inverse() * (true_depth(rig, T_world_a, pixel_a) * rig.unproject(pixel_a, rig.focal_px * rig.baseline_m));
    const Eigen::Vector2d error = c.b.head<2>() - rig.project(p_b);
    ++errors.found;
    errors.mean += error;
    errors.rms += error.squaredNorm();
  }
  errors.mean /= static_cast<double>(errors.found);
  errors.rms = std::sqrt(errors.rms / static_cast<double>(errors.found));
  return errors;
}

TEST(AlignPixel, FindsAPatchUnderStretchAndShift) {
  const Pose guess_error(rotation_from_rpy(0.001, -0.002, 0.001), {0.003, 0.002, -0.004});
  const MatchErrors errors =
      direct_match_errors(T_world_left(0.0, 0.0, 0.0), T_world_left(0.05, 0.25, 0.06), guess_error);
  ASSERT_GT(errors.found, 100U);
  EXPECT_LT(errors.rms, 0.2);
}

TEST(FindDirectly, IsUnbiasedOnGroundThatThePerspectiveStretchesUnevenly) {
  const RectifiedRig rig = test_rig();
  const Pose T_world_a = T_world_left(0.0, 0.0, 0.0), T_world_b = T_world_left(0.0, 1.0, 0.0);
  const auto a = render_pair(rig, T_world_a, 3), b = render_pair(rig, T_world_b, 4);
  const StereoView view_a{nullptr, std::make_shared<Image>(a.left), std::make_shared<Image>(a.right)};
  const StereoView view_b{nullptr, std::make_shared<Image>(b.left), std::make_shared<Image>(b.right)};
  const Pose T_b_a = T_world_b.inverse() * T_world_a;
  const auto disparity = [&](const Eigen::Vector2d& pixel) {
    return rig.disparity_px(true_depth(rig, T_world_a, pixel));
  };
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int found = 0;
  for (const Eigen::Vector2f& keypoint : grid(rig, 2.9F)) {
    const Eigen::Vector2d at = keypoint.cast<double>(), right = at + Eigen::Vector2d::UnitX(),
                          below = at + Eigen::Vector2d::UnitY();
    const PatchPoint point{{at.x(), at.y(), disparity(at)},
                           {disparity(right) - disparity(at), disparity(below) - disparity(at)}};
    const auto seen = find_directly(rig, view_a, point, view_b, T_b_a);
    if (!seen) continue;
    sum += seen->pixel.head<2>() - rig.project(T_b_a * unproject(rig, point.pixel));
    ++found;
  }
  ASSERT_GT(found, 100);
  EXPECT_LT((sum / found).norm(), 0.01);
}

}  // namespace
}  // namespace demslam

#include "demslam/odometry/direct_match.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <Eigen/LU>
#include <cmath>
#include <optional>

#include "demslam/odometry/patch_align.h"
#include "demslam/odometry/refine.h"

namespace demslam {
namespace {

constexpr float kMinCorrelation = 0.8F;
constexpr double kMinScale = 0.4, kMaxScale = 2.5;  // of a patch between the views
constexpr double kMinDepthM = 1e-3;

/// A point of a as it should appear in b.
struct Prediction {
  StereoPixel b;
  Eigen::Matrix2f A_b_a;  ///< patch offsets of a into offsets of b
};

std::optional<Prediction> predict(const RectifiedRig& rig, const StereoPixel& a, const Eigen::Vector2d& slope,
                                  const Pose& T_b_a) {
  const Eigen::Vector3d p_b = T_b_a * unproject(rig, a);
  if (p_b.z() < kMinDepthM) return std::nullopt;
  const Eigen::Matrix3d J = projection_jacobian(rig, p_b) * T_b_a.rotation_matrix() * unprojection_jacobian(rig, a);
  // Along the surface d changes with u and v by its slope.
  const Eigen::Matrix2d A = J.topLeftCorner<2, 2>() + J.topRightCorner<2, 1>() * slope.transpose();
  const double scale = std::sqrt(std::abs(A.determinant()));
  if (!(A.determinant() > 0.0) || scale < kMinScale || scale > kMaxScale) return std::nullopt;
  return Prediction{.b = project(rig, p_b), .A_b_a = A.cast<float>()};
}

/// (u, v, d) in b, d = 0 where the right image shows something else.
std::optional<StereoPixel> align(const StereoView& a, const StereoView& b, const Eigen::Vector2f& pixel_a,
                                 const Prediction& predicted) {
  const Eigen::Vector2f guess = predicted.b.head<2>().cast<float>();
  const auto aligned = align_pixel(*a.left, pixel_a, *b.left, guess, predicted.A_b_a);
  if (!aligned || aligned->correlation < kMinCorrelation) return std::nullopt;
  const auto disparity = align_disparity(*b.left, *b.right, aligned->pixel, static_cast<float>(predicted.b.z()));
  const bool good = disparity && disparity->correlation >= kMinCorrelation && disparity->disparity_px > 0.0F;
  return StereoPixel(aligned->pixel.x(), aligned->pixel.y(), good ? disparity->disparity_px : 0.0);
}

}  // namespace

DirectMatches match_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Pose& T_a_b) {
  const Pose T_b_a = T_a_b.inverse();
  const std::vector<Eigen::Vector2f>& keypoints = a.features->left.keypoints;
  std::vector<std::optional<Correspondence>> found(keypoints.size());
  const auto find = [&](std::size_t i) {
    if (!a.features->has_depth(i)) return;
    const StereoPixel pixel_a(keypoints[i].x(), keypoints[i].y(), a.features->disparity_px[i]);
    const auto predicted = predict(rig, pixel_a, a.features->disparity_slope[i].cast<double>(), T_b_a);
    if (!predicted) return;
    if (const auto pixel_b = align(a, b, keypoints[i], *predicted)) found[i] = Correspondence{pixel_a, *pixel_b};
  };
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, keypoints.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) find(i);
  });
  DirectMatches matches;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i]) continue;
    matches.correspondences.push_back(*found[i]);
    matches.keypoints_a.push_back(static_cast<int>(i));
  }
  return matches;
}

Motion refine_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Motion& motion,
                       const MotionOptions& options) {
  const DirectMatches direct = match_directly(rig, a, b, motion.T_a_b);
  const double pixel = options.aligned_sigma_px, disparity = options.disparity_sigma_px;
  const StereoNoise noise{.a = {0.0, 0.0, disparity}, .b = {pixel, pixel, disparity}};
  const std::optional<RefinedPose> refined = refine_pose(rig, direct.correspondences, noise, motion.T_a_b);
  if (!refined || refined->inliers < motion.inliers) return motion;
  return {.ok = true,
          .T_a_b = refined->T_a_b,
          .covariance = refined->covariance,
          .matches = static_cast<int>(direct.correspondences.size()),
          .inliers = refined->inliers,
          .rms_px = refined->rms_px};
}

}  // namespace demslam

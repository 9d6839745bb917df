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
constexpr double kLeastSigmaPx = 0.1;  // of any alignment: patches are not quite planes

/// A point of a as it should appear in b, and the homography from offsets around it there to pixels of a.
struct Prediction {
  StereoPixel b;
  Eigen::Matrix3f H_a_b;
};

/// Pixel of a to pixel of b for the plane of a point: along it the disparity changes with u and v by its slope. In (u,
/// v, parallax) a plane is a plane and a motion is projective, so that this is exact.
Eigen::Matrix3d plane_homography(const RectifiedRig& rig, const PatchPoint& point, const Pose& T_b_a) {
  const Eigen::Vector2d slope = point.slope.cast<double>();
  const double parallax_at_origin = rig.parallax_px(point.pixel.z()) - slope.dot(point.pixel.head<2>());
  const double f = rig.focal_px, baseline = rig.baseline_m;
  Eigen::Matrix3d K, ray;  // ray: baseline times the direction of a pixel
  K << f, 0.0, rig.cx, 0.0, f, rig.cy, 0.0, 0.0, 1.0;
  ray << baseline, 0.0, -baseline * rig.cx, 0.0, baseline, -baseline * rig.cy, 0.0, 0.0, baseline * f;
  const Eigen::RowVector3d parallax(slope.x(), slope.y(), parallax_at_origin);
  return K * (T_b_a.rotation_matrix() * ray + T_b_a.translation() * parallax);
}

std::optional<Prediction> predict(const RectifiedRig& rig, const PatchPoint& point, const Pose& T_b_a) {
  const Eigen::Vector3d p_b = T_b_a * unproject(rig, point.pixel);
  if (p_b.z() < kMinDepthM) return std::nullopt;
  const StereoPixel b = project(rig, p_b);
  Eigen::Matrix3d offset = Eigen::Matrix3d::Identity();
  offset.topRightCorner<2, 1>() = b.head<2>();
  Eigen::Matrix3d H = plane_homography(rig, point, T_b_a).inverse() * offset;
  H /= H(2, 2);
  // At the centre: d(pixel of a) / d(pixel of b).
  const Eigen::Matrix2d A = H.topLeftCorner<2, 2>() - H.topRightCorner<2, 1>() * H.bottomLeftCorner<1, 2>();
  const double scale = 1.0 / std::sqrt(std::abs(A.determinant()));
  if (!(A.determinant() > 0.0) || !(scale > kMinScale && scale < kMaxScale)) return std::nullopt;
  return Prediction{.b = b, .H_a_b = H.cast<float>()};
}

}  // namespace

std::optional<DirectSighting> find_directly(const RectifiedRig& rig, const StereoView& a, const PatchPoint& point,
                                            const StereoView& b, const Pose& T_b_a) {
  const std::optional<Prediction> predicted = predict(rig, point, T_b_a);
  if (!predicted) return std::nullopt;
  const auto aligned = align_pixel(*a.left, *b.left, predicted->b.head<2>().cast<float>(), predicted->H_a_b);
  if (!aligned || aligned->correlation < kMinCorrelation) return std::nullopt;
  const auto guess_disparity = static_cast<float>(predicted->b.z());
  const auto disparity = align_disparity(*b.left, *b.right, aligned->pixel, guess_disparity);
  const bool good = disparity && disparity->correlation >= kMinCorrelation && disparity->disparity_px > 0.0F;
  DirectSighting sighting{.pixel = {aligned->pixel.x(), aligned->pixel.y(), good ? disparity->disparity_px : 0.0},
                          .covariance = kLeastSigmaPx * kLeastSigmaPx * Eigen::Matrix3d::Identity()};
  sighting.covariance.topLeftCorner<2, 2>() += aligned->covariance_px2.cast<double>();
  if (good) sighting.covariance(2, 2) += disparity->variance_px2;
  return sighting;
}

std::vector<Correspondence> match_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b,
                                           const Pose& T_a_b) {
  const Pose T_b_a = T_a_b.inverse();
  const StereoFeatures& features = *a.features;
  std::vector<std::optional<Correspondence>> found(features.left.size());
  const auto find = [&](std::size_t i) {
    if (!features.has_depth(i)) return;
    const PatchPoint point{features.stereo_pixel(i), features.disparity_slope[i]};
    if (const auto seen = find_directly(rig, a, point, b, T_b_a)) {
      found[i] = Correspondence{point.pixel, seen->pixel, seen->covariance};
    }
  };
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, found.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) find(i);
  });
  std::vector<Correspondence> correspondences;
  for (const auto& correspondence : found) {
    if (correspondence) correspondences.push_back(*correspondence);
  }
  return correspondences;
}

Motion refine_directly(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const Motion& motion,
                       const MotionOptions& options) {
  const std::vector<Correspondence> direct = match_directly(rig, a, b, motion.T_a_b);
  const std::optional<RefinedPose> refined = refine_pose(rig, direct, aligned_noise(rig, options), motion.T_a_b);
  if (!refined || refined->inliers < motion.inliers) return motion;
  return {.ok = true,
          .T_a_b = refined->T_a_b,
          .covariance = refined->covariance,
          .matches = static_cast<int>(direct.size()),
          .inliers = refined->inliers,
          .rms_px = refined->rms_px};
}

}  // namespace demslam

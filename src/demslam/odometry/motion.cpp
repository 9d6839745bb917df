#include "demslam/odometry/motion.h"

#include <algorithm>

#include "demslam/odometry/disparity.h"
#include "demslam/odometry/ransac.h"
#include "demslam/odometry/refine.h"

namespace demslam {
namespace {

/// Matches whose first view has a depth.
std::vector<Correspondence> correspond(const StereoFeatures& a, const StereoFeatures& b, Matcher& matcher) {
  std::vector<Correspondence> correspondences;
  if (a.left.size() == 0 || b.left.size() == 0) return correspondences;
  for (const Match& match : matcher.match(a.left, b.left)) {
    if (!a.has_depth(match.query)) continue;
    correspondences.push_back({a.stereo_pixel(match.query), b.stereo_pixel(match.train)});
  }
  return correspondences;
}

Motion failed(const std::string& what, int matches, int inliers) {
  Motion motion;
  motion.reason = "too few " + what + " (" + std::to_string(what == "matches" ? matches : inliers) + ")";
  motion.matches = matches;
  motion.inliers = inliers;
  return motion;
}

}  // namespace

double far_disparity_px(const RectifiedRig& rig, const MotionOptions& options) {
  constexpr double kLeastPx = 0.5;  // below, no alignment of patches tells near from far
  return std::max({kLeastPx, rig.disparity_px(options.max_depth_m),
                   rig.disparity_px(options.max_depth_baselines * rig.baseline_m)});
}

StereoNoise detected_noise(const RectifiedRig& rig, const MotionOptions& options) {
  const Eigen::Vector3d sigma(options.pixel_sigma_px, options.pixel_sigma_px, options.disparity_sigma_px);
  return {
      .a = sigma, .b = sigma, .far_disparity_px = far_disparity_px(rig, options), .far_sigma_px = options.far_sigma_px};
}

StereoNoise aligned_noise(const RectifiedRig& rig, const MotionOptions& options) {
  StereoNoise noise = detected_noise(rig, options);
  noise.a.head<2>().setZero();
  return noise;
}

StereoFeatures match_stereo(const RectifiedRig& rig, Features left_features, const Image& left, const Image& right,
                            const MotionOptions& options) {
  DisparityOptions search;
  if (!options.use_far_points) search.min_disparity_px = far_disparity_px(rig, options);
  search.max_disparity_px = std::min<double>(rig.width, rig.disparity_px(options.min_depth_m));
  StereoFeatures features;
  Disparities found = find_disparities(left, right, left_features.keypoints, search);
  features.disparity_px = std::move(found.disparity_px);
  features.disparity_slope = std::move(found.slope);
  features.left = std::move(left_features);
  return features;
}

Motion estimate_motion(const RectifiedRig& rig, const StereoFeatures& a, const StereoFeatures& b, Matcher& matcher,
                       const MotionOptions& options, const Pose* guess_T_a_b) {
  return estimate_motion(rig, correspond(a, b, matcher), options, guess_T_a_b);
}

Motion estimate_motion(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                       const MotionOptions& options, const Pose* guess_T_a_b) {
  const int matches = static_cast<int>(correspondences.size());
  if (matches < options.min_inliers) return failed("matches", matches, 0);
  const RansacOptions ransac{.threshold_px = options.ransac_threshold_px,
                             .iterations = options.ransac_iterations,
                             .min_inliers = options.min_inliers,
                             .seed = options.seed};
  const std::optional<Pose> initial = find_pose(rig, correspondences, ransac, guess_T_a_b);
  if (!initial) return failed("inliers", matches, 0);
  const std::optional<RefinedPose> refined = refine_pose(rig, correspondences, detected_noise(rig, options), *initial);
  if (!refined) return failed("inliers", matches, 0);
  if (refined->inliers < options.min_inliers) return failed("inliers", matches, refined->inliers);
  return {.ok = true,
          .T_a_b = refined->T_a_b,
          .covariance = refined->covariance,
          .matches = matches,
          .inliers = refined->inliers,
          .rms_px = refined->rms_px};
}

}  // namespace demslam

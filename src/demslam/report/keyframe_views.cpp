#include "demslam/report/keyframe_views.h"

#include <algorithm>
#include <numeric>

#include "demslam/features/nearest_matcher.h"

namespace demslam {
namespace {

constexpr double kRatio = 0.9, kAgreement_px = 3.0;

/// Indices of the `count` best scores, best first.
std::vector<std::size_t> best_of(const Features& features, std::size_t count) {
  std::vector<std::size_t> order(features.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return features.scores[a] > features.scores[b]; });
  order.resize(std::min(order.size(), count));
  return order;
}

Features chosen(const Features& all, const std::vector<std::size_t>& indices) {
  Features features{.image_width = all.image_width, .image_height = all.image_height};
  features.descriptors.resize(static_cast<Eigen::Index>(indices.size()), all.descriptors.cols());
  for (const std::size_t i : indices) {
    features.descriptors.row(static_cast<Eigen::Index>(features.size())) =
        all.descriptors.row(static_cast<Eigen::Index>(i));
    features.keypoints.push_back(all.keypoints[i]);
    features.scores.push_back(all.scores[i]);
  }
  return features;
}

/// Where the older left camera saw a point of the newer one; behind it or without depth: no agreement.
bool agrees(const RectifiedRig& rig, const Pose& T_before_now, const Eigen::Vector2f& pixel, float disparity_px,
            const Eigen::Vector2f& pixel_before) {
  if (disparity_px <= 0.0F) return false;
  const Eigen::Vector3d p = T_before_now * rig.unproject(pixel.cast<double>(), disparity_px);
  return p.z() > 0.1 && (rig.project(p) - pixel_before.cast<double>()).norm() < kAgreement_px;
}

}  // namespace

KeyframeView view_of(const StereoFeatures& features, const StereoFeatures* before, const RelativePose* measurement,
                     const RectifiedRig& rig, std::size_t max_features) {
  const std::vector<std::size_t> best = best_of(features.left, max_features);
  const Features shown = chosen(features.left, best);
  KeyframeView view{.pixels = shown.keypoints, .disparities_px = {}, .matches = {}};
  for (const std::size_t i : best) view.disparities_px.push_back(features.disparity_px[i]);
  if (before == nullptr || measurement == nullptr || shown.size() == 0 || before->left.size() == 0) return view;
  const Pose T_left_before_now = rig.T_body_left.inverse() * measurement->T_i_j * rig.T_body_left;
  for (const Match& match : NearestMatcher(kRatio).match(shown, before->left)) {
    const auto q = static_cast<std::size_t>(match.query);
    const Eigen::Vector2f& pixel_before = before->left.keypoints[static_cast<std::size_t>(match.train)];
    if (agrees(rig, T_left_before_now, view.pixels[q], view.disparities_px[q], pixel_before))
      view.matches.push_back({q, pixel_before});
  }
  return view;
}

}  // namespace demslam

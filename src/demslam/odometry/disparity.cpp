#include "demslam/odometry/disparity.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "demslam/odometry/patch_align.h"
#include "demslam/odometry/row_search.h"

namespace demslam {
namespace {

/// Whole-pixel disparity that left-to-right and right-to-left searches agree on.
std::optional<float> search_disparity(const RowSearch& to_right, const RowSearch& to_left,
                                      const Eigen::Vector2f& keypoint, const DisparityOptions& options,
                                      std::vector<int>& costs) {
  const int u = static_cast<int>(std::lround(keypoint.x())), v = static_cast<int>(std::lround(keypoint.y()));
  const int nearest = static_cast<int>(std::ceil(options.max_disparity_px));
  const auto there = to_right.search(u, v, -nearest, 0, costs);
  if (!there.found || there.uniqueness > options.uniqueness) return std::nullopt;
  const auto back = to_left.search(u + there.shift_px, v, 0, nearest, costs);
  if (!back.found || std::abs(there.shift_px + back.shift_px) > options.left_right_tolerance_px) return std::nullopt;
  return static_cast<float>(-there.shift_px);
}

}  // namespace

Disparities find_disparities(const Image& left, const Image& right, const std::vector<Eigen::Vector2f>& keypoints,
                             const DisparityOptions& options) {
  const Image left_gradient = gradient_image(left), right_gradient = gradient_image(right);
  const RowSearch to_right(left_gradient, right_gradient), to_left(right_gradient, left_gradient);
  Disparities found;
  found.disparity_px.assign(keypoints.size(), 0.0F);
  found.slope.assign(keypoints.size(), Eigen::Vector2f::Zero());
  const auto find = [&](std::size_t i, std::vector<int>& costs) {
    // The row search works around whole pixels: its disparity may be off by half a pixel, which the alignment mends.
    const std::optional<float> coarse = search_disparity(to_right, to_left, keypoints[i], options, costs);
    if (!coarse) return;
    const auto fine = align_disparity(left, right, keypoints[i], *coarse);
    if (!fine || fine->correlation < options.min_correlation || fine->disparity_px < options.min_disparity_px ||
        fine->disparity_px > options.max_disparity_px) {
      return;
    }
    found.disparity_px[i] = std::max(fine->disparity_px, kLeastDisparityPx);
    found.slope[i] = fine->slope;
  };
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, keypoints.size(), 64), [&](const auto& range) {
    std::vector<int> costs;
    for (std::size_t i = range.begin(); i != range.end(); ++i) find(i, costs);
  });
  return found;
}

}  // namespace demslam

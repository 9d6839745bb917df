#include "demslam/features/classical_extractor.h"

#include <algorithm>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace demslam {
namespace {

constexpr int kBorderPx = 10;            // a corner nearer to the edge has less than half of its descriptor's patch
constexpr int kCellPx = 32;              // corners take turns by cell, so that rocks do not starve the regolith
constexpr float kMinResponse = 1e-6F;    // of cornerMinEigenVal on 8-bit images: below it is rounding noise
constexpr float kDescriptorSize = 4.0F;  // keypoint diameter; SIFT's patch is 6 times as wide

/// Offset of a parabola's peak through three samples, within half a sample.
float peak_offset(float before, float centre, float after) {
  const float curvature = before - 2.0F * centre + after;
  return curvature < 0.0F ? 0.5F * (before - after) / curvature : 0.0F;
}

cv::KeyPoint corner_at(const cv::Mat1f& response, int u, int v) {
  const float centre = response(v, u);
  const float du = peak_offset(response(v, u - 1), centre, response(v, u + 1));
  const float dv = peak_offset(response(v - 1, u), centre, response(v + 1, u));
  return {static_cast<float>(u) + du, static_cast<float>(v) + dv, kDescriptorSize, 0.0F, centre, 0};
}

/// Local maxima of the response in 5x5 pixels, in row order.
std::vector<cv::KeyPoint> find_corners(const cv::Mat1b& image) {
  cv::Mat1f response, dilated;
  cv::cornerMinEigenVal(image, response, 3);
  cv::dilate(response, dilated, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  std::vector<cv::KeyPoint> corners;
  for (int v = kBorderPx; v < image.rows - kBorderPx; ++v) {
    for (int u = kBorderPx; u < image.cols - kBorderPx; ++u) {
      if (response(v, u) > kMinResponse && response(v, u) == dilated(v, u))
        corners.push_back(corner_at(response, u, v));
    }
  }
  return corners;
}

/// The strongest corner of every cell, then the second of every cell, and so on, until `count` are taken.
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint> corners, cv::Size size, std::size_t count) {
  std::stable_sort(corners.begin(), corners.end(),
                   [](const auto& a, const auto& b) { return a.response > b.response; });
  const int columns = size.width / kCellPx + 1;
  std::vector<int> taken(static_cast<std::size_t>(columns) * (size.height / kCellPx + 1), 0);
  for (cv::KeyPoint& corner : corners) {
    const int cell = static_cast<int>(corner.pt.y) / kCellPx * columns + static_cast<int>(corner.pt.x) / kCellPx;
    corner.class_id = taken[cell]++;
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const auto& a, const auto& b) { return a.class_id < b.class_id; });
  corners.resize(std::min(corners.size(), count));
  return corners;
}

Features to_features(const std::vector<cv::KeyPoint>& corners, const cv::Mat1f& descriptors, const Image& image) {
  Features features{.image_width = image.width, .image_height = image.height};
  for (const cv::KeyPoint& corner : corners) {
    features.keypoints.emplace_back(corner.pt.x, corner.pt.y);
    features.scores.push_back(corner.response);
  }
  features.descriptors.resize(descriptors.rows, descriptors.cols);
  std::copy_n(reinterpret_cast<const float*>(descriptors.data), descriptors.total(), features.descriptors.data());
  features.descriptors.rowwise().normalize();
  return features;
}

}  // namespace

Features ClassicalExtractor::extract(const Image& image) {
  if (std::min(image.width, image.height) <= 2 * kBorderPx)
    return {.image_width = image.width, .image_height = image.height};
  const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels.data()));
  std::vector<cv::KeyPoint> corners = spread(find_corners(view), view.size(), max_features_);
  cv::Mat1f descriptors;
  if (!corners.empty()) cv::SIFT::create(0, 1)->compute(view, corners, descriptors);
  return to_features(corners, descriptors, image);
}

}  // namespace demslam

#pragma once

#include <Eigen/Core>
#include <optional>

#include "demslam/image/image.h"

namespace demslam {

/// Grey value between pixels; the point must lie inside by one pixel.
inline float sample(const Image& image, float u, float v) {
  const int iu = static_cast<int>(u), iv = static_cast<int>(v);
  const float fu = u - static_cast<float>(iu), fv = v - static_cast<float>(iv);
  const std::uint8_t* p = image.pixels.data() + static_cast<std::size_t>(iv) * image.width + iu;
  const float top = static_cast<float>(p[0]) + fu * (static_cast<float>(p[1]) - static_cast<float>(p[0]));
  const std::uint8_t* q = p + image.width;
  const float bottom = static_cast<float>(q[0]) + fu * (static_cast<float>(q[1]) - static_cast<float>(q[0]));
  return top + fv * (bottom - top);
}

/// A disparity as the patch alignment sees it.
struct AlignedDisparity {
  float disparity_px = 0.0F;
  float correlation = 0.0F;  ///< normalised, of the aligned patches
};

/// Aligns the patch around `pixel` of the left image with the right image: Lucas-Kanade along the row with disparity
/// d + d_u * du + d_v * dv, both patches with their mean taken off. None if it leaves the image or wanders off.
std::optional<AlignedDisparity> align_disparity(const Image& left, const Image& right, const Eigen::Vector2f& pixel,
                                                float disparity_px);

}  // namespace demslam

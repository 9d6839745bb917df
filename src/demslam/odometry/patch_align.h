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
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();  ///< d(disparity) / d(u, v): how the surface lies
  float correlation = 0.0F;                         ///< normalised, of the aligned patches
  float variance_px2 = 0.0F;                        ///< of the disparity, see AlignedPixel
};

/// Aligns the patch around `pixel` of the left image with the right image: Lucas-Kanade along the row with disparity
/// d + d_u * du + d_v * dv, both patches with their mean and gain taken off. None if it leaves the image or wanders
/// off.
std::optional<AlignedDisparity> align_disparity(const Image& left, const Image& right, const Eigen::Vector2f& pixel,
                                                float disparity_px);

/// A pixel as the patch alignment sees it.
struct AlignedPixel {
  Eigen::Vector2f pixel;
  float correlation = 0.0F;
  /// What is left between the aligned patches, over their gradients: small across edges, large along them.
  Eigen::Matrix2f covariance_px2 = Eigen::Matrix2f::Zero();
};

/// Finds a patch of one image in another near `guess_b`: Lucas-Kanade (inverse compositional) in two dimensions, both
/// patches with their mean and gain taken off. The homography `H_a_b` maps offsets from the patch's centre in b to
/// pixels of a. None if it leaves either image or wanders off.
std::optional<AlignedPixel> align_pixel(const Image& a, const Image& b, const Eigen::Vector2f& guess_b,
                                        const Eigen::Matrix3f& H_a_b);

}  // namespace demslam

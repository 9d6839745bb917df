#include "demslam/odometry/patch_align.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace demslam {
namespace {

constexpr int kHalf = 5;  // patch of 11 x 11
constexpr int kSide = 2 * kHalf + 1;
constexpr int kIterations = 12;
constexpr float kMaxShiftPx = 2.0F;  // from the whole-pixel search
constexpr float kMaxSlope = 0.6F;    // disparity per pixel
constexpr float kConvergedPx = 0.005F;

using Patch = Eigen::Matrix<float, kSide * kSide, 1>;
constexpr float kMaxRowOffsetPx = 1.5F;

/// Right patch against left one: (d, d_u, d_v, row offset). Rows of real rigs are off by a few tenths of a pixel; left
/// unmodelled that leaks into the disparity wherever the texture runs diagonally.
using Warp = Eigen::Vector4f;

bool inside(const Image& image, float u, float v, float margin) {
  return u >= margin && v >= margin && u < static_cast<float>(image.width) - 1.0F - margin &&
         v < static_cast<float>(image.height) - 1.0F - margin;
}

/// A patch, its mean taken off, and its gradient.
struct Template {
  Patch values;
  Eigen::Matrix<float, kSide * kSide, 2> gradient;
};

/// The patch of an image on a grid whose offsets the homography maps to pixels.
std::optional<Template> make_template(const Image& image, const Eigen::Matrix3f& H) {
  constexpr int kBorder = kHalf + 1, kPitch = 2 * kBorder + 1;
  std::array<float, kPitch * kPitch> grey;
  for (int dv = -kBorder, k = 0; dv <= kBorder; ++dv) {
    for (int du = -kBorder; du <= kBorder; ++du, ++k) {
      const Eigen::Vector3f at = H * Eigen::Vector3f(static_cast<float>(du), static_cast<float>(dv), 1.0F);
      const float u = at.x() / at.z(), v = at.y() / at.z();
      if (!(at.z() > 0.0F) || !inside(image, u, v, 0.0F)) return std::nullopt;
      grey[k] = sample(image, u, v);
    }
  }
  Template result;
  for (int row = 0, k = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column, ++k) {
      const float* at = grey.data() + (row + 1) * kPitch + column + 1;
      result.values[k] = *at;
      result.gradient(k, 0) = 0.5F * (at[1] - at[-1]);
      result.gradient(k, 1) = 0.5F * (at[kPitch] - at[-kPitch]);
    }
  }
  result.values.array() -= result.values.mean();
  result.gradient.rowwise() -= result.gradient.colwise().mean().eval();
  return result;
}

using DisparityJacobian = Eigen::Matrix<float, kSide * kSide, 4>;

DisparityJacobian disparity_jacobian(const Template& left) {
  DisparityJacobian J;
  for (int row = 0, k = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column, ++k) {
      const float slope = left.gradient(k, 0);
      J.row(k) << slope, slope * static_cast<float>(column - kHalf), slope * static_cast<float>(row - kHalf),
          -left.gradient(k, 1);
    }
  }
  J.rowwise() -= J.colwise().mean().eval();
  return J;
}

/// J^T J, with what a patch cannot tell from noise held near zero.
Eigen::Matrix4f disparity_hessian(const DisparityJacobian& J) {
  Eigen::Matrix4f H = J.transpose() * J;
  const float texture = H(0, 0);
  H.diagonal() += Eigen::Vector4f(0.0F, 1e-2F, 1e-2F, 1e-2F) * texture;
  return H;
}

/// The right patch at (u - (d + d_u du + d_v dv), v + row offset); false when it leaves the image.
bool sample_right(const Image& right, const Eigen::Vector2f& pixel, const Warp& warp, Patch& values) {
  const float reach = static_cast<float>(kHalf) * (1.0F + std::abs(warp[1]) + std::abs(warp[2]));
  if (!inside(right, pixel.x() - warp[0], pixel.y() + warp[3], reach)) return false;
  for (int dv = -kHalf, k = 0; dv <= kHalf; ++dv) {
    const float start = pixel.x() - warp[0] - warp[2] * static_cast<float>(dv);
    const float v = pixel.y() + warp[3] + static_cast<float>(dv);
    for (int du = -kHalf; du <= kHalf; ++du, ++k) {
      values[k] = sample(right, start + static_cast<float>(du) * (1.0F - warp[1]), v);
    }
  }
  values.array() -= values.mean();
  return true;
}

bool is_plausible(const Warp& warp, float start_px) {
  return std::abs(warp[0] - start_px) <= kMaxShiftPx && std::abs(warp[1]) <= kMaxSlope &&
         std::abs(warp[2]) <= kMaxSlope && std::abs(warp[3]) <= kMaxRowOffsetPx;
}

/// A patch without stretch: one set of bilinear weights serves all its pixels.
bool sample_upright(const Image& image, const Eigen::Vector2f& pixel, Patch& values) {
  if (!inside(image, pixel.x(), pixel.y(), static_cast<float>(kHalf))) return false;
  const int u = static_cast<int>(pixel.x()), v = static_cast<int>(pixel.y());
  const float fu = pixel.x() - static_cast<float>(u), fv = pixel.y() - static_cast<float>(v);
  const float w00 = (1 - fu) * (1 - fv), w01 = fu * (1 - fv), w10 = (1 - fu) * fv, w11 = fu * fv;
  for (int row = 0; row < kSide; ++row) {
    const std::uint8_t* p = image.pixels.data() + static_cast<std::size_t>(v - kHalf + row) * image.width + u - kHalf;
    const std::uint8_t* q = p + image.width;
    for (int i = 0; i < kSide; ++i) {
      values[row * kSide + i] = w00 * p[i] + w01 * p[i + 1] + w10 * q[i] + w11 * q[i + 1];
    }
  }
  values.array() -= values.mean();
  return true;
}

/// Per pixel, from the sum of squares left over; interpolated neighbours share their noise.
float grey_variance(float squared_residual) {
  constexpr float kPixelsPerMeasurement = 4.0F;
  return squared_residual * kPixelsPerMeasurement / static_cast<float>(kSide * kSide);
}

}  // namespace

std::optional<AlignedDisparity> align_disparity(const Image& left, const Image& right, const Eigen::Vector2f& pixel,
                                                float disparity_px) {
  Eigen::Matrix3f upright = Eigen::Matrix3f::Identity();
  upright.topRightCorner<2, 1>() = pixel;
  const std::optional<Template> reference = make_template(left, upright);
  if (!reference) return std::nullopt;
  const DisparityJacobian J = disparity_jacobian(*reference);
  const Eigen::Matrix4f H = disparity_hessian(J);
  const float norm = reference->values.norm();
  if (norm < 1.0F || H(0, 0) < 1.0F) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix4f> solver(H);

  Warp warp(disparity_px, 0.0F, 0.0F, 0.0F);
  Patch values;
  float correlation = 0.0F, residual = 0.0F;
  for (int i = 0; i < kIterations; ++i) {
    if (!sample_right(right, pixel, warp, values)) return std::nullopt;
    const float values_norm = values.norm();
    if (values_norm < 1.0F) return std::nullopt;
    correlation = reference->values.dot(values) / (norm * values_norm);
    const Patch left_over = values * (norm / values_norm) - reference->values;
    residual = left_over.squaredNorm();
    const Warp step = solver.solve(J.transpose() * left_over);
    warp += step;
    if (!is_plausible(warp, disparity_px)) return std::nullopt;
    if (std::abs(step[0]) < kConvergedPx) break;
  }
  return AlignedDisparity{.disparity_px = warp[0],
                          .slope = warp.segment<2>(1),
                          .correlation = correlation,
                          .variance_px2 = grey_variance(residual) * solver.solve(Warp::UnitX()).x()};
}

std::optional<AlignedPixel> align_pixel(const Image& a, const Image& b, const Eigen::Vector2f& guess_b,
                                        const Eigen::Matrix3f& H_a_b) {
  const std::optional<Template> reference = make_template(a, H_a_b);
  if (!reference) return std::nullopt;
  const float norm = reference->values.norm();
  const Eigen::Matrix2f H = reference->gradient.transpose() * reference->gradient;
  if (norm < 1.0F || H.determinant() < 1e-3F * H.trace() * H.trace()) return std::nullopt;
  const Eigen::Matrix2f H_inverse = H.inverse();

  Eigen::Vector2f pixel = guess_b;
  Patch values;
  float correlation = 0.0F, residual = 0.0F;
  for (int i = 0; i < kIterations; ++i) {
    if (!sample_upright(b, pixel, values)) return std::nullopt;
    const float values_norm = values.norm();
    if (values_norm < 1.0F) return std::nullopt;
    correlation = reference->values.dot(values) / (norm * values_norm);
    const Patch left_over = values * (norm / values_norm) - reference->values;
    residual = left_over.squaredNorm();
    const Eigen::Vector2f step = H_inverse * (reference->gradient.transpose() * left_over);
    pixel -= step;
    if ((pixel - guess_b).norm() > kMaxShiftPx) return std::nullopt;
    if (step.norm() < kConvergedPx) break;
  }
  return AlignedPixel{
      .pixel = pixel, .correlation = correlation, .covariance_px2 = grey_variance(residual) * H_inverse};
}

}  // namespace demslam

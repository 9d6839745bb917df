#include "demslam/odometry/patch_align.h"

#include <Eigen/Cholesky>
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
using Jacobian = Eigen::Matrix<float, kSide * kSide, 3>;

bool inside(const Image& image, float u, float v, float margin) {
  return u >= margin && v >= margin && u < static_cast<float>(image.width) - 1.0F - margin &&
         v < static_cast<float>(image.height) - 1.0F - margin;
}

/// Left patch, its mean taken off, and the derivatives of a patch by (d, d_u, d_v).
struct Template {
  Patch values;
  Jacobian jacobian;
};

Template make_template(const Image& left, const Eigen::Vector2f& pixel) {
  Template result;
  int k = 0;
  for (int dv = -kHalf; dv <= kHalf; ++dv) {
    for (int du = -kHalf; du <= kHalf; ++du, ++k) {
      const float u = pixel.x() + static_cast<float>(du), v = pixel.y() + static_cast<float>(dv);
      const float slope = 0.5F * (sample(left, u + 1.0F, v) - sample(left, u - 1.0F, v));
      result.values[k] = sample(left, u, v);
      result.jacobian.row(k) << slope, slope * static_cast<float>(du), slope * static_cast<float>(dv);
    }
  }
  result.values.array() -= result.values.mean();
  result.jacobian.rowwise() -= result.jacobian.colwise().mean().eval();
  return result;
}

/// The right patch at u - (d + d_u du + d_v dv); false when it leaves the image.
bool sample_right(const Image& right, const Eigen::Vector2f& pixel, const Eigen::Vector3f& warp, Patch& values) {
  const float reach = static_cast<float>(kHalf) * (1.0F + std::abs(warp[1]) + std::abs(warp[2]));
  if (!inside(right, pixel.x() - warp[0], pixel.y(), reach)) return false;
  int k = 0;
  for (int dv = -kHalf; dv <= kHalf; ++dv) {
    const float start = pixel.x() - warp[0] - warp[2] * static_cast<float>(dv);
    for (int du = -kHalf; du <= kHalf; ++du, ++k) {
      const float u = start + static_cast<float>(du) * (1.0F - warp[1]);
      values[k] = sample(right, u, pixel.y() + static_cast<float>(dv));
    }
  }
  values.array() -= values.mean();
  return true;
}

}  // namespace

std::optional<AlignedDisparity> align_disparity(const Image& left, const Image& right, const Eigen::Vector2f& pixel,
                                                float disparity_px) {
  if (!inside(left, pixel.x(), pixel.y(), static_cast<float>(kHalf) + 1.0F)) return std::nullopt;
  const Template reference = make_template(left, pixel);
  const float norm = reference.values.norm();
  Eigen::Matrix3f H = reference.jacobian.transpose() * reference.jacobian;
  const float texture = H(0, 0);
  if (norm < 1.0F || texture < 1.0F) return std::nullopt;
  // Shear and stretch are held near zero where the patch cannot tell them from noise.
  H(1, 1) += 1e-2F * texture;
  H(2, 2) += 1e-2F * texture;
  const Eigen::LDLT<Eigen::Matrix3f> solver(H);

  Eigen::Vector3f warp(disparity_px, 0.0F, 0.0F);
  Patch values;
  float correlation = 0.0F;
  for (int i = 0; i < kIterations; ++i) {
    if (!sample_right(right, pixel, warp, values)) return std::nullopt;
    const float right_norm = values.norm();
    if (right_norm < 1.0F) return std::nullopt;
    correlation = reference.values.dot(values) / (norm * right_norm);
    const Eigen::Vector3f step =
        solver.solve(reference.jacobian.transpose() * (values * (norm / right_norm) - reference.values));
    warp += step;
    if (std::abs(warp[0] - disparity_px) > kMaxShiftPx || warp.tail<2>().cwiseAbs().maxCoeff() > kMaxSlope) {
      return std::nullopt;
    }
    if (std::abs(step[0]) < kConvergedPx) break;
  }
  return AlignedDisparity{.disparity_px = warp[0], .correlation = correlation};
}

}  // namespace demslam

#include "demslam/image/rectify.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr double kIdealPx = 1e-6;                               // intrinsics closer than this are equal
constexpr double kIdealRad = 1e-8;                              // axes closer than this are aligned
constexpr double kMaxRayRad = 70.0 / 180.0 * std::numbers::pi;  // wider rays are cut
constexpr int kBorderSamples = 64;                              // per image side

/// Intrinsics and orientations of the ideal pair.
struct IdealPair {
  double focal_px = 0.0, cx = 0.0, cy = 0.0;
  Eigen::Matrix3d R_left_ideal = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d R_right_ideal = Eigen::Matrix3d::Identity();
};

bool is_ideal(const Camera& camera) {
  return camera.distortion == Distortion::none && std::abs(camera.fx - camera.fy) < kIdealPx;
}

bool axes_are_aligned(const StereoRig& rig) {
  const Eigen::Vector3d direction = rig.T_left_right.translation().normalized();
  return rig.T_left_right.rotation().angularDistance(Eigen::Quaterniond::Identity()) < kIdealRad &&
         (direction - Eigen::Vector3d::UnitX()).norm() < kIdealRad;
}

/// Both cameras ideal, aligned and equal but for the principal point: the left one needs no change.
bool left_can_stay(const StereoRig& rig) {
  return is_ideal(rig.left) && is_ideal(rig.right) && axes_are_aligned(rig) &&
         std::abs(rig.left.fx - rig.right.fx) < kIdealPx;
}

bool same_camera(const Camera& a, const IdealPair& ideal) {
  return std::abs(a.fx - ideal.focal_px) < kIdealPx && std::abs(a.cx - ideal.cx) < kIdealPx &&
         std::abs(a.cy - ideal.cy) < kIdealPx;
}

/// Axes of the ideal pair: x along the baseline, z as near as possible to the mean of both optical axes.
Eigen::Matrix3d ideal_axes(const StereoRig& rig) {
  const Eigen::Vector3d x = rig.T_left_right.translation().normalized();
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitZ() + rig.T_left_right.rotation_matrix().col(2);
  if (x.x() < std::numbers::sqrt2 / 2 || forward.norm() < 1.0) {
    throw Error(
        "calibration: the right camera must stand to the right of the left one and look the same way; "
        "are left and right swapped?");
  }
  const Eigen::Vector3d y = forward.cross(x).normalized();
  Eigen::Matrix3d R_left_ideal;
  R_left_ideal << x, y, x.cross(y);
  return R_left_ideal;
}

cv::Mat camera_matrix(const Camera& camera) {
  return (cv::Mat_<double>(3, 3) << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
}

cv::Mat camera_matrix(const IdealPair& ideal) {
  return (cv::Mat_<double>(3, 3) << ideal.focal_px, 0.0, ideal.cx, 0.0, ideal.focal_px, ideal.cy, 0.0, 0.0, 1.0);
}

cv::Mat distortion_coefficients(const Camera& camera) {
  if (camera.distortion == Distortion::none) return cv::Mat::zeros(5, 1, CV_64F);
  const std::size_t count = camera.distortion == Distortion::equidistant ? 4 : 5;
  const std::vector<double> k(camera.coefficients.begin(), camera.coefficients.begin() + count);
  return cv::Mat(k, true);
}

cv::Mat to_cv(const Eigen::Matrix3d& R) {
  cv::Mat matrix;
  cv::eigen2cv(R, matrix);
  return matrix;
}

/// Points (u, v) of a raw image as (x / z, y / z) in the ideal camera's frame.
std::vector<cv::Point2d> undistort(const Camera& camera, const Eigen::Matrix3d& R_camera_ideal,
                                   const std::vector<cv::Point2d>& pixels) {
  std::vector<cv::Point2d> rays;
  const cv::Mat R_ideal_camera = to_cv(R_camera_ideal.transpose());
  if (camera.distortion == Distortion::equidistant) {
    cv::fisheye::undistortPoints(pixels, rays, camera_matrix(camera), distortion_coefficients(camera), R_ideal_camera);
  } else {
    const cv::TermCriteria exact(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-10);
    cv::undistortPoints(pixels, rays, camera_matrix(camera), distortion_coefficients(camera), R_ideal_camera,
                        cv::noArray(), exact);
  }
  const double limit = std::tan(kMaxRayRad);
  for (cv::Point2d& ray : rays) {
    const double radius = std::hypot(ray.x, ray.y);
    if (radius > limit) ray *= limit / radius;
  }
  return rays;
}

struct Rectangle {
  double left = -1e9, top = -1e9, right = 1e9, bottom = 1e9;
};

/// Shrinks `inner` until a camera sees all of it.
void shrink_to_view(const Camera& camera, const Eigen::Matrix3d& R_camera_ideal, Rectangle& inner) {
  const auto side = [&](cv::Point2d from, cv::Point2d to) {
    std::vector<cv::Point2d> pixels(kBorderSamples + 1);
    for (int i = 0; i <= kBorderSamples; ++i)
      pixels[i] = from + (to - from) * (static_cast<double>(i) / kBorderSamples);
    return undistort(camera, R_camera_ideal, pixels);
  };
  const double right = camera.width - 1.0, bottom = camera.height - 1.0;
  for (const auto& ray : side({0.0, 0.0}, {0.0, bottom})) inner.left = std::max(inner.left, ray.x);
  for (const auto& ray : side({right, 0.0}, {right, bottom})) inner.right = std::min(inner.right, ray.x);
  for (const auto& ray : side({0.0, 0.0}, {right, 0.0})) inner.top = std::max(inner.top, ray.y);
  for (const auto& ray : side({0.0, bottom}, {right, bottom})) inner.bottom = std::min(inner.bottom, ray.y);
}

/// The widest view at the raw images' size and square pixels that both cameras see all of.
IdealPair fit_common_view(const StereoRig& rig) {
  IdealPair ideal;
  ideal.R_left_ideal = ideal_axes(rig);
  ideal.R_right_ideal = rig.T_left_right.rotation_matrix().transpose() * ideal.R_left_ideal;
  Rectangle inner;
  shrink_to_view(rig.left, ideal.R_left_ideal, inner);
  shrink_to_view(rig.right, ideal.R_right_ideal, inner);
  const double width = inner.right - inner.left, height = inner.bottom - inner.top;
  if (!(width > 0.05 && height > 0.05)) {
    throw Error(
        "calibration: the two cameras see too little in common to be rectified; check the distortion "
        "coefficients and the rotation between the cameras");
  }
  const double span_u = rig.left.width - 1.0, span_v = rig.left.height - 1.0;
  ideal.focal_px = std::max(span_u / width, span_v / height);
  ideal.cx = 0.5 * span_u - ideal.focal_px * 0.5 * (inner.left + inner.right);
  ideal.cy = 0.5 * span_v - ideal.focal_px * 0.5 * (inner.top + inner.bottom);
  return ideal;
}

IdealPair ideal_pair(const StereoRig& rig) {
  if (!left_can_stay(rig)) return fit_common_view(rig);
  return {.focal_px = rig.left.fx, .cx = rig.left.cx, .cy = rig.left.cy};
}

RectifiedRig rectified_rig(const StereoRig& rig, const IdealPair& ideal) {
  return {.width = rig.left.width,
          .height = rig.left.height,
          .focal_px = ideal.focal_px,
          .cx = ideal.cx,
          .cy = ideal.cy,
          .baseline_m = rig.T_left_right.translation().norm(),
          .T_body_left = rig.T_body_left * Pose(ideal.R_left_ideal, Eigen::Vector3d::Zero()),
          .p_body_ground = rig.p_body_ground};
}

/// Where in the raw image each ideal pixel is found.
struct Map {
  cv::Mat u, v;  // empty: the image stays as it is

  Image apply(const Image& raw) const {
    if (u.empty()) return raw;
    assert(raw.width == u.cols && raw.height == u.rows);
    const cv::Mat source(raw.height, raw.width, CV_8U, const_cast<std::uint8_t*>(raw.pixels.data()));
    Image ideal(raw.width, raw.height);
    cv::Mat target(ideal.height, ideal.width, CV_8U, ideal.pixels.data());
    cv::remap(source, target, u, v, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    return ideal;
  }
};

Map make_map(const Camera& camera, const Eigen::Matrix3d& R_camera_ideal, const IdealPair& ideal) {
  const cv::Mat R_ideal_camera = to_cv(R_camera_ideal.transpose());
  const cv::Size size(camera.width, camera.height);
  Map map;
  if (camera.distortion == Distortion::equidistant) {
    cv::fisheye::initUndistortRectifyMap(camera_matrix(camera), distortion_coefficients(camera), R_ideal_camera,
                                         camera_matrix(ideal), size, CV_32F, map.u, map.v);
  } else {
    cv::initUndistortRectifyMap(camera_matrix(camera), distortion_coefficients(camera), R_ideal_camera,
                                camera_matrix(ideal), size, CV_32F, map.u, map.v);
  }
  return map;
}

}  // namespace

struct Rectifier::Maps {
  RectifiedRig rig;
  Map left, right;
};

Rectifier::Rectifier(const StereoRig& rig) : maps_(std::make_unique<Maps>()) {
  const IdealPair ideal = ideal_pair(rig);
  maps_->rig = rectified_rig(rig, ideal);
  if (left_can_stay(rig) && same_camera(rig.right, ideal)) return;
  if (!left_can_stay(rig)) maps_->left = make_map(rig.left, ideal.R_left_ideal, ideal);
  maps_->right = make_map(rig.right, ideal.R_right_ideal, ideal);
}

Rectifier::~Rectifier() = default;
Rectifier::Rectifier(Rectifier&&) noexcept = default;

const RectifiedRig& Rectifier::rig() const { return maps_->rig; }
bool Rectifier::is_identity() const { return maps_->left.u.empty() && maps_->right.u.empty(); }
Image Rectifier::left(const Image& raw) const { return maps_->left.apply(raw); }
Image Rectifier::right(const Image& raw) const { return maps_->right.apply(raw); }

}  // namespace demslam

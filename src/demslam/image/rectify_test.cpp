#include "demslam/image/rectify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/random.h"

namespace demslam {
namespace {

Camera ideal_camera() { return {.width = 320, .height = 240, .fx = 250.0, .fy = 250.0, .cx = 160.0, .cy = 118.0}; }

StereoRig ideal_rig() {
  return {.left = ideal_camera(),
          .right = ideal_camera(),
          .T_left_right = Pose(Eigen::Quaterniond::Identity(), {0.2, 0.0, 0.0})};
}

/// Two different, distorted cameras, turned against each other.
StereoRig awkward_rig(Distortion distortion) {
  StereoRig rig = ideal_rig();
  rig.left.fx = 251.0, rig.left.fy = 249.0;
  rig.right.cx = 157.0, rig.right.cy = 123.0;
  rig.left.distortion = rig.right.distortion = distortion;
  rig.left.coefficients = {-0.12, 0.03, 0.001, -0.0005, 0.0};
  rig.right.coefficients = {-0.11, 0.02, -0.0007, 0.0004, 0.0};
  if (distortion == Distortion::equidistant) rig.left.coefficients[4] = rig.right.coefficients[4] = 0.0;
  rig.T_left_right = Pose(rotation_from_rpy(0.02, -0.03, 0.015), {0.2, 0.006, -0.004});
  rig.T_body_left = Pose(rotation_from_rpy(0.1, 0.4, -0.2) * R_body_camera_level(), {0.5, 0.1, 1.2});
  return rig;
}

/// Where a camera sees a point of its frame: the forward model, written down independently of the rectification.
Eigen::Vector2d see(const Camera& camera, const Eigen::Vector3d& p) {
  double x = p.x() / p.z(), y = p.y() / p.z();
  const auto& k = camera.coefficients;
  const double r2 = x * x + y * y, r = std::sqrt(r2);
  if (camera.distortion == Distortion::radtan) {
    const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    const double xd = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    y = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
    x = xd;
  } else if (camera.distortion == Distortion::equidistant) {
    const double t = std::atan(r), t2 = t * t;
    const double scale = t * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))) / r;
    x *= scale;
    y *= scale;
  }
  return {camera.fx * x + camera.cx, camera.fy * y + camera.cy};
}

/// An image with a soft bright spot, and where the brightness of an image is centred.
Image spot_at(const Eigen::Vector2d& centre, const Camera& camera) {
  Image image(camera.width, camera.height);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double distance2 = (Eigen::Vector2d(u, v) - centre).squaredNorm();
      image.at(u, v) = static_cast<std::uint8_t>(std::lround(250.0 * std::exp(-0.5 * distance2 / 9.0)));
    }
  }
  return image;
}

Eigen::Vector2d centroid(const Image& image) {
  Eigen::Vector2d sum(0.0, 0.0);
  double weight = 0.0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      sum += image.at(u, v) * Eigen::Vector2d(u, v);
      weight += image.at(u, v);
    }
  }
  return sum / weight;
}

class RectifierOfDistorted : public testing::TestWithParam<Distortion> {};

TEST_P(RectifierOfDistorted, PutsAPointWhereTheIdealRigSeesIt) {
  const StereoRig rig = awkward_rig(GetParam());
  const Rectifier rectifier(rig);
  const RectifiedRig& ideal = rectifier.rig();
  EXPECT_FALSE(rectifier.is_identity());
  EXPECT_NEAR(ideal.baseline_m, rig.T_left_right.translation().norm(), 1e-12);
  for (const Eigen::Vector3d& p_left :
       {Eigen::Vector3d(0.1, 0.1, 2.0), Eigen::Vector3d(-0.6, 0.4, 3.0), Eigen::Vector3d(0.9, -0.5, 3.0)}) {
    // T_body_left of both rigs ties the raw to the ideal camera.
    const Eigen::Vector3d p_ideal = ideal.T_body_left.inverse() * (rig.T_body_left * p_left);
    const Eigen::Vector2d left = centroid(rectifier.left(spot_at(see(rig.left, p_left), rig.left)));
    const Eigen::Vector3d p_right = rig.T_left_right.inverse() * p_left;
    const Eigen::Vector2d right = centroid(rectifier.right(spot_at(see(rig.right, p_right), rig.right)));
    EXPECT_LT((left - ideal.project(p_ideal)).norm(), 0.1) << left.transpose();
    EXPECT_NEAR(left.y(), right.y(), 0.1);
    EXPECT_NEAR(left.x() - right.x(), ideal.disparity_px(p_ideal.z()), 0.1);
  }
}

TEST_P(RectifierOfDistorted, RepeatsNoBorderOfTheRawImages) {
  const StereoRig rig = awkward_rig(GetParam());
  const Rectifier rectifier(rig);
  // Repeated borders would show as a black frame that grows.
  Image framed(320, 240, 200);
  for (int u = 0; u < 320; ++u) framed.at(u, 0) = framed.at(u, 239) = 0;
  const Image left = rectifier.left(framed);
  int dark_rows = 0;
  for (int v = 0; v < 240; ++v) dark_rows += left.at(160, v) < 100 ? 1 : 0;
  EXPECT_LE(dark_rows, 2);
}

INSTANTIATE_TEST_SUITE_P(Lenses, RectifierOfDistorted,
                         testing::Values(Distortion::none, Distortion::radtan, Distortion::equidistant));

TEST(Rectifier, IdealPairPassesThroughByteForByte) {
  Random random(3);
  Image image(320, 240);
  for (auto& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random.index(256));
  const Rectifier rectifier(ideal_rig());
  EXPECT_TRUE(rectifier.is_identity());
  EXPECT_EQ(rectifier.left(image).pixels, image.pixels);
  EXPECT_EQ(rectifier.right(image).pixels, image.pixels);
  EXPECT_DOUBLE_EQ(rectifier.rig().focal_px, 250.0);
  EXPECT_DOUBLE_EQ(rectifier.rig().cy, 118.0);
}

TEST(Rectifier, RowOffsetMovesTheRightImageOnly) {
  StereoRig rig = ideal_rig();
  rig.right.cy += 3.0;
  Random random(3);
  Image image(320, 240);
  for (auto& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random.index(256));
  const Rectifier rectifier(rig);
  EXPECT_FALSE(rectifier.is_identity());
  EXPECT_EQ(rectifier.left(image).pixels, image.pixels);
  const Image right = rectifier.right(image);
  for (int u = 0; u < 320; ++u) ASSERT_EQ(right.at(u, 100), image.at(u, 103)) << u;
}

TEST(Rectifier, RefusesSwappedCameras) {
  StereoRig rig = ideal_rig();
  rig.T_left_right = rig.T_left_right.inverse();
  EXPECT_THAT([&] { Rectifier{rig}; }, testing::ThrowsMessage<Error>(testing::HasSubstr("swapped")));
}

TEST(Rectifier, RefusesCamerasThatLookApart) {
  StereoRig rig = ideal_rig();
  rig.T_left_right = Pose(rotation_from_rpy(0.0, 1.5, 0.0), {0.2, 0.0, 0.0});
  EXPECT_THROW(Rectifier{rig}, Error);
}

}  // namespace
}  // namespace demslam

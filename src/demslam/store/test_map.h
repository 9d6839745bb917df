#pragma once

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "demslam/base/random.h"
#include "demslam/store/map_store.h"

namespace demslam::test {

inline constexpr std::size_t kFramesPerKeyframe = 3;

inline MapHeader small_header() {
  const Pose T_body_left(R_body_camera_level(), {0.5, 0.1, 1.2});
  return {.rig = {640, 480, 400.1, 319.5, 239.5, 0.3, T_body_left, {0.0, 0.0, -0.4}},
          .config_toml = "[odometry]\nkeyframe_max_distance_m = 2.0\n",
          .inputs = "{\"dataset\": \"moon\"}"};
}

inline Pose random_pose(Random& random) {
  Vector6d xi;
  for (double& value : xi) value = random.normal();
  return Pose::exp(0.3 * xi);
}

/// Unit descriptor rows, as extractors make them; every third point without a disparity.
inline std::shared_ptr<StereoFeatures> random_features(std::uint64_t seed, std::size_t count = 20, int width = 16) {
  Random random(seed);
  auto features = std::make_shared<StereoFeatures>();
  Features& left = features->left;
  left.image_width = 640;
  left.image_height = 480;
  left.descriptors.resize(static_cast<Eigen::Index>(count), width);
  for (float& value : left.descriptors.reshaped()) value = static_cast<float>(random.normal());
  left.descriptors.rowwise().normalize();
  for (std::size_t i = 0; i < count; ++i) {
    left.keypoints.emplace_back(static_cast<float>(random.uniform(0, 640)), static_cast<float>(random.uniform(0, 480)));
    left.scores.push_back(static_cast<float>(random.uniform()));
    features->disparity_px.push_back(i % 3 == 0 ? 0.0F : static_cast<float>(random.uniform(2, 60)));
  }
  return features;
}

/// Keyframe `index` of a drive along +x, a metre per keyframe; the same whenever it is asked for.
inline KeyframeEntry entry(std::size_t index, std::size_t features = 20, int width = 16) {
  Random random(index, 77);
  const Pose T_map_body(rotation_from_rpy(0.01, 0.02, 0.1 * random.normal()),
                        {double(index), 0.1 * random.normal(), 0.0});
  const std::size_t frame = index * kFramesPerKeyframe;
  KeyframeEntry result{
      .keyframe = {index, frame, TimestampNs(frame) * 100'000'000, T_map_body, random_pose(random), "anchor"},
      .features = random_features(index, features, width),
      .checkpoint = "state at " + std::to_string(index)};
  if (index > 0) {
    const Matrix6d covariance = 1e-4 * Matrix6d::Identity();
    result.factors.push_back({.measurement = {index - 1, index, random_pose(random), covariance}, .inliers = 80});
  }
  for (std::size_t f = index == 0 ? 0 : frame + 1 - kFramesPerKeyframe; f <= frame; ++f) {
    const std::size_t reference = f == frame ? index : index - 1;
    const Pose T_reference_body = f == frame ? Pose() : random_pose(random);
    result.frames.push_back({f, TimestampNs(f) * 100'000'000, "tracked", reference, T_reference_body, "{\"frame\":1}"});
  }
  return result;
}

/// A closed map of `keyframes` keyframes.
inline std::filesystem::path make_map(const std::filesystem::path& file, std::size_t keyframes) {
  MapStore store = MapStore::create(file, small_header());
  for (std::size_t k = 0; k < keyframes; ++k) store.append(entry(k));
  return file;
}

inline bool same_bits(const Pose& a, const Pose& b) {
  return a.rotation().coeffs() == b.rotation().coeffs() && a.translation() == b.translation();
}

inline bool same_bits(const StereoFeatures& a, const StereoFeatures& b) {
  return a.left.image_width == b.left.image_width && a.left.image_height == b.left.image_height &&
         a.left.keypoints == b.left.keypoints && a.left.scores == b.left.scores && a.disparity_px == b.disparity_px &&
         a.left.descriptors.rows() == b.left.descriptors.rows() && a.left.descriptors == b.left.descriptors;
}

}  // namespace demslam::test

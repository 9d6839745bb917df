#pragma once

// For tests only: scenes whose truth is exact.

#include <algorithm>
#include <cmath>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/image/image.h"
#include "demslam/odometry/correspondence.h"

namespace demslam::testing_scene {

inline RectifiedRig test_rig() {
  return {.width = 320, .height = 240, .focal_px = 250.0, .cx = 160.0, .cy = 118.0, .baseline_m = 0.2};
}

/// Points in the common view of two stereo views, measured with normal noise.
inline std::vector<Correspondence> random_correspondences(const RectifiedRig& rig, const Pose& T_a_b,
                                                          const StereoNoise& noise, int count, Random& random) {
  const auto measure = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& sigma) {
    StereoPixel pixel = project(rig, p);
    for (int i = 0; i < 3; ++i) pixel[i] += sigma[i] * random.normal();
    return pixel;
  };
  std::vector<Correspondence> result;
  while (static_cast<int>(result.size()) < count) {
    const Eigen::Vector2d pixel(random.uniform(0.0, rig.width), random.uniform(0.0, rig.height));
    const Eigen::Vector3d p_a = rig.unproject(pixel, random.uniform(3.0, 25.0));
    const Eigen::Vector3d p_b = T_a_b.inverse() * p_a;
    if (p_b.z() < 0.5) continue;
    const Correspondence seen{measure(p_a, noise.a), measure(p_b, noise.b)};
    if (has_disparity(seen.a) && has_disparity(seen.b)) result.push_back(seen);
  }
  return result;
}

/// Smooth noise in [0, 1] on a lattice of one unit, the same for everyone.
inline double lattice_noise(double x, double y, std::uint64_t stream) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto corner = [&](int dx, int dy) {
    const auto ix = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx) + dx);
    const auto iy = static_cast<std::uint64_t>(static_cast<std::int64_t>(fy) + dy);
    return static_cast<double>(Random::mix(Random::mix(Random::mix(stream + 1) ^ ix) ^ iy) >> 11) * 0x1.0p-53;
  };
  const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double u = smooth(x - fx), v = smooth(y - fy);
  return (corner(0, 0) * (1 - u) + corner(1, 0) * u) * (1 - v) + (corner(0, 1) * (1 - u) + corner(1, 1) * u) * v;
}

/// A textured plane, y = 1.2 m in a world whose axes are right, down, forward: grey values 0 to 255.
inline double ground_grey(double x, double z) {
  double grey = 0.0;
  double weight = 0.5;
  double cell_m = 0.32;
  for (std::uint64_t octave = 0; octave < 4; ++octave, weight *= 0.7, cell_m *= 0.5) {
    grey += weight * (lattice_noise(x / cell_m, z / cell_m, octave) - 0.5);
  }
  return 128.0 + 220.0 * grey;
}

/// The left camera over the plane, looking forward and 35 degrees down.
inline Pose T_world_left(double x_m, double z_m, double heading_rad) {
  const Eigen::Quaterniond R(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(-0.6, Eigen::Vector3d::UnitX()));
  return Pose(R, {x_m, 0.0, z_m});
}

/// What a camera of the rig sees of the plane. `seed` draws the sensor's noise (two grey levels).
inline Image render(const RectifiedRig& rig, const Pose& T_world_camera, std::uint64_t seed) {
  Random random(seed);
  Image image(rig.width, rig.height);
  for (int v = 0; v < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      const Eigen::Vector3d ray = T_world_camera.rotation() * rig.unproject({u, v}, rig.focal_px * rig.baseline_m);
      const double distance = 1.2 / ray.y();
      const Eigen::Vector3d p = T_world_camera.translation() + distance * ray;
      const double grey = ray.y() > 0.0 && distance < 30.0 ? ground_grey(p.x(), p.z()) : 20.0;
      image.at(u, v) = static_cast<std::uint8_t>(std::lround(std::clamp(grey + 2.0 * random.normal(), 0.0, 255.0)));
    }
  }
  return image;
}

struct RenderedPair {
  Image left, right;
};

inline RenderedPair render_pair(const RectifiedRig& rig, const Pose& T_world_left, std::uint64_t seed) {
  const Pose T_left_right(Eigen::Quaterniond::Identity(), {rig.baseline_m, 0.0, 0.0});
  return {render(rig, T_world_left, 2 * seed), render(rig, T_world_left * T_left_right, 2 * seed + 1)};
}

}  // namespace demslam::testing_scene

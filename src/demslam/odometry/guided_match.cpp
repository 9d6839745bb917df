#include "demslam/odometry/guided_match.h"

#include <cmath>
#include <limits>

namespace demslam {
namespace {

constexpr double kMinDepth_m = 0.1;
constexpr double kDisparityTolerance = 0.3;  // relative; the prediction is not exact
constexpr double kDisparityTolerance_px = 3.0;

struct Rival {
  int index = -1;
  double squared_distance = std::numeric_limits<double>::infinity();
};

bool could_be(const StereoPixel& predicted, const StereoPixel& seen, double radius_px) {
  if ((seen - predicted).head<2>().squaredNorm() > radius_px * radius_px) return false;
  return !has_disparity(seen) ||
         std::abs(seen.z() - predicted.z()) < kDisparityTolerance_px + kDisparityTolerance * predicted.z();
}

/// The best likeness near the prediction; none where another one is nearly as good.
Rival best_near(const StereoPixel& predicted, const StereoFeatures& a, std::size_t i, const StereoFeatures& b,
                double radius_px, double ratio) {
  Rival best, second;
  for (std::size_t j = 0; j < b.left.size(); ++j) {
    if (!could_be(predicted, b.stereo_pixel(j), radius_px)) continue;
    const double d2 = 2.0 - 2.0 * a.left.descriptors.row(i).dot(b.left.descriptors.row(j));
    if (d2 < best.squared_distance) {
      second = best;
      best = {static_cast<int>(j), d2};
    } else if (d2 < second.squared_distance) {
      second = {static_cast<int>(j), d2};
    }
  }
  return best.squared_distance < ratio * ratio * second.squared_distance ? best : Rival{};
}

}  // namespace

std::vector<Correspondence> match_near(const RectifiedRig& rig, const StereoFeatures& a, const StereoFeatures& b,
                                       const Pose& T_a_b, double radius_px, double ratio) {
  const Pose T_b_a = T_a_b.inverse();
  std::vector<Rival> best_of_b(b.left.size());  // index into a
  for (std::size_t i = 0; i < a.left.size(); ++i) {
    if (!a.has_depth(i)) continue;
    const Eigen::Vector3d p_b = T_b_a * unproject(rig, a.stereo_pixel(i));
    if (p_b.z() < kMinDepth_m) continue;
    const Rival found = best_near(project(rig, p_b), a, i, b, radius_px, ratio);
    if (found.index < 0) continue;
    Rival& taken = best_of_b[static_cast<std::size_t>(found.index)];
    if (found.squared_distance < taken.squared_distance) taken = {static_cast<int>(i), found.squared_distance};
  }
  std::vector<Correspondence> matches;
  for (std::size_t j = 0; j < best_of_b.size(); ++j) {
    if (best_of_b[j].index >= 0) matches.push_back({a.stereo_pixel(best_of_b[j].index), b.stereo_pixel(j)});
  }
  return matches;
}

}  // namespace demslam

#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/base/random.h"
#include "demslam/features/features.h"

namespace demslam::test {

/// Smooth random relief around grey 128, defined at every real place, so that it can be drawn shifted by any amount.
class Texture {
 public:
  explicit Texture(std::uint64_t seed) {
    Random random(seed);
    for (Wave& wave : waves_) {
      const double angle = random.uniform(0.0, 6.283185307179586), length_px = random.uniform(6.0, 40.0);
      wave = {6.283185307179586 * std::cos(angle) / length_px, 6.283185307179586 * std::sin(angle) / length_px,
              random.uniform(0.0, 6.283185307179586)};
    }
  }

  /// What stands at (u, v) of the texture appears at (u + shift_u, v + shift_v) of the image.
  Image draw(int width_px, int height_px, double shift_u = 0.0, double shift_v = 0.0) const {
    Image image(width_px, height_px);
    for (int v = 0; v < height_px; ++v) {
      for (int u = 0; u < width_px; ++u) image.at(u, v) = grey(u - shift_u, v - shift_v);
    }
    return image;
  }

 private:
  struct Wave {
    double u, v, phase;
  };
  std::uint8_t grey(double u, double v) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += std::sin(wave.u * u + wave.v * v + wave.phase);
    return static_cast<std::uint8_t>(std::lround(std::clamp(128.0 + 18.0 * sum, 0.0, 255.0)));
  }
  std::array<Wave, 24> waves_;
};

/// Median displacement of the matches and how many lie within 1 px of it.
struct Shift {
  Eigen::Vector2d median;
  double share_within_1px = 0.0;
};

inline Shift shift_of(const Features& a, const Features& b, const std::vector<Match>& matches) {
  std::vector<double> du, dv;
  for (const Match& m : matches) {
    const Eigen::Vector2f d = b.keypoints[m.train] - a.keypoints[m.query];
    du.push_back(d.x());
    dv.push_back(d.y());
  }
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  Shift shift{{median(du), median(dv)}};
  int near = 0;
  for (std::size_t i = 0; i < du.size(); ++i)
    near += std::hypot(du[i] - shift.median.x(), dv[i] - shift.median.y()) < 1.0;
  shift.share_within_1px = static_cast<double>(near) / static_cast<double>(du.size());
  return shift;
}

}  // namespace demslam::test

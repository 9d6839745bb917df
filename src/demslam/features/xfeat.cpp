#include "demslam/features/xfeat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace demslam {
namespace {

constexpr int kCell = 8, kLogits = kCell * kCell + 1;
constexpr float kMinProbability = 0.05F;
constexpr int kSuppression = 2;  // 5x5 pixels

/// Channel-major maps as one row per cell.
DescriptorRows cells_by_channels(const std::vector<float>& map, int channels) {
  const auto cells = static_cast<Eigen::Index>(map.size()) / channels;
  return Eigen::Map<const DescriptorRows>(map.data(), channels, cells).transpose();
}

/// Probability of a keypoint at each pixel: softmax within the cell, "none" dropped.
DescriptorRows heat_map(const XFeatMaps& maps) {
  const DescriptorRows cells = cells_by_channels(maps.keypoint_logits, kLogits);
  DescriptorRows heat(maps.rows * kCell, maps.columns * kCell);
  for (int r = 0; r < maps.rows; ++r) {
    for (int c = 0; c < maps.columns; ++c) {
      Eigen::Array<float, kLogits, 1> odds = cells.row(r * maps.columns + c).transpose().array();
      odds = (odds - odds.maxCoeff()).exp();
      odds /= odds.sum();
      const Eigen::Map<const Eigen::Matrix<float, kCell, kCell, Eigen::RowMajor>> pixels(odds.data());
      heat.block<kCell, kCell>(r * kCell, c * kCell) = pixels;
    }
  }
  return heat;
}

bool is_peak(const DescriptorRows& heat, Eigen::Index v, Eigen::Index u) {
  const Eigen::Index top = std::max<Eigen::Index>(v - kSuppression, 0),
                     left = std::max<Eigen::Index>(u - kSuppression, 0);
  const Eigen::Index bottom = std::min(v + kSuppression, heat.rows() - 1),
                     right = std::min(u + kSuppression, heat.cols() - 1);
  return heat(v, u) >= heat.block(top, left, bottom - top + 1, right - left + 1).maxCoeff();
}

/// The network's maps at pixels of its input image.
class Sampler {
 public:
  explicit Sampler(const XFeatMaps& maps) : maps_(maps), descriptors_(cells_by_channels(maps.descriptors, maps.width)) {
    descriptors_.rowwise().normalize();
  }

  float reliability(int u, int v) const {
    const auto [x, y] = place(u, v);
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
    const auto at = [&](int c, int r) { return inside(c, r) ? maps_.reliability[r * maps_.columns + c] : 0.0F; };
    return (1.0F - fy) * ((1.0F - fx) * at(x0, y0) + fx * at(x0 + 1, y0)) +
           fy * ((1.0F - fx) * at(x0, y0 + 1) + fx * at(x0 + 1, y0 + 1));
  }

  Eigen::RowVectorXf descriptor(int u, int v) const {
    const auto [x, y] = place(u, v);
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const auto wx = cubic_weights(x - static_cast<float>(x0)), wy = cubic_weights(y - static_cast<float>(y0));
    Eigen::RowVectorXf sum = Eigen::RowVectorXf::Zero(maps_.width);
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        const int c = x0 - 1 + i, r = y0 - 1 + j;
        if (inside(c, r)) sum += wx[i] * wy[j] * descriptors_.row(r * maps_.columns + c);
      }
    }
    return sum.normalized();
  }

 private:
  bool inside(int c, int r) const { return c >= 0 && r >= 0 && c < maps_.columns && r < maps_.rows; }

  /// Pixel -> map as the network was trained: 2 x / (W - 1) - 1 read with align_corners = false.
  std::pair<float, float> place(int u, int v) const {
    const auto along = [](int pixel, int cells) {
      return static_cast<float>(pixel) * static_cast<float>(cells) / static_cast<float>(cells * kCell - 1) - 0.5F;
    };
    return {along(u, maps_.columns), along(v, maps_.rows)};
  }

  /// Keys' cubic convolution with a = -0.75, for the samples at -1, 0, 1, 2.
  static std::array<float, 4> cubic_weights(float t) {
    constexpr float a = -0.75F;
    const auto near = [](float d) { return ((a + 2.0F) * d - (a + 3.0F)) * d * d + 1.0F; };
    const auto far = [](float d) { return ((a * d - 5.0F * a) * d + 8.0F * a) * d - 4.0F * a; };
    return {far(t + 1.0F), near(t), near(1.0F - t), far(2.0F - t)};
  }

  const XFeatMaps& maps_;
  DescriptorRows descriptors_;  ///< one unit row per cell
};

struct Peak {
  int u, v;
};

/// Sub-pixel place of a peak: top of the parabola through the log-probabilities of three pixels.
float peak_offset(float before, float centre, float after) {
  const auto log = [](float probability) { return std::log(std::max(probability, 1e-9F)); };
  const float l = log(before), c = log(centre), r = log(after);
  const float curvature = l - 2.0F * c + r;
  return curvature < 0.0F ? std::clamp(0.5F * (l - r) / curvature, -0.5F, 0.5F) : 0.0F;
}

Eigen::Vector2f sub_pixel(const DescriptorRows& heat, const Peak& peak) {
  Eigen::Vector2f place(static_cast<float>(peak.u), static_cast<float>(peak.v));
  if (peak.u > 0 && peak.u + 1 < heat.cols()) {
    place.x() += peak_offset(heat(peak.v, peak.u - 1), heat(peak.v, peak.u), heat(peak.v, peak.u + 1));
  }
  if (peak.v > 0 && peak.v + 1 < heat.rows()) {
    place.y() += peak_offset(heat(peak.v - 1, peak.u), heat(peak.v, peak.u), heat(peak.v + 1, peak.u));
  }
  return place;
}

std::vector<Peak> find_peaks(const DescriptorRows& heat, int image_width, int image_height) {
  std::vector<Peak> peaks;
  for (int v = 0; v < image_height; ++v) {
    for (int u = 0; u < image_width; ++u) {
      if (heat(v, u) > kMinProbability && is_peak(heat, v, u)) peaks.push_back({u, v});
    }
  }
  return peaks;
}

}  // namespace

std::vector<std::size_t> strongest(const std::vector<float>& scores, int count) {
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
  order.resize(std::min(order.size(), static_cast<std::size_t>(std::max(count, 0))));
  return order;
}

Features decode_xfeat(const XFeatMaps& maps, int image_width, int image_height, int max_features) {
  const DescriptorRows heat = heat_map(maps);
  const std::vector<Peak> peaks = find_peaks(heat, image_width, image_height);
  const Sampler sampler(maps);
  std::vector<float> scores;
  for (const Peak& peak : peaks) scores.push_back(heat(peak.v, peak.u) * sampler.reliability(peak.u, peak.v));

  Features features{.image_width = image_width, .image_height = image_height};
  const std::vector<std::size_t> order = strongest(scores, max_features);
  features.descriptors.resize(static_cast<Eigen::Index>(order.size()), maps.width);
  for (const std::size_t i : order) {
    features.descriptors.row(static_cast<Eigen::Index>(features.size())) = sampler.descriptor(peaks[i].u, peaks[i].v);
    features.keypoints.push_back(sub_pixel(heat, peaks[i]));
    features.scores.push_back(scores[i]);
  }
  return features;
}

}  // namespace demslam

#include "demslam/features/xfeat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace demslam {
namespace {

constexpr int kCell = 8, kLogits = kCell * kCell + 1;
constexpr int kSuppression = 2;  // 5x5 pixels

/// A map with one row per cell: as it is, or turned.
class CellRows {
 public:
  CellRows(const std::vector<float>& map, int channels, bool by_cell) {
    const auto cells = static_cast<Eigen::Index>(map.size()) / channels;
    if (!by_cell) turned_ = Eigen::Map<const DescriptorRows>(map.data(), channels, cells).transpose();
    new (&rows_) Rows(by_cell ? map.data() : turned_.data(), cells, channels);  // how Eigen's maps are moved
  }
  CellRows(const CellRows&) = delete;

  using Rows = Eigen::Map<const DescriptorRows>;
  const Rows& rows() const { return rows_; }

 private:
  DescriptorRows turned_;
  Rows rows_{nullptr, 0, 0};
};

/// Probability of a keypoint at each pixel: softmax within the cell, "none" dropped. Cells in which no pixel can come
/// near the least probability that counts are left at zero until they are asked for: nothing in them can be a
/// keypoint, nor suppress one.
class HeatMap {
 public:
  HeatMap(const XFeatMaps& maps, float min_probability)
      : columns_(maps.columns),
        min_probability_(min_probability),
        logits_(maps.keypoint_logits, kLogits, maps.logits_by_cell),
        heat_(DescriptorRows::Zero(maps.rows * kCell, maps.columns * kCell)),
        known_(static_cast<std::size_t>(maps.rows) * maps.columns, false) {
    for (Eigen::Index cell = 0; cell < logits_.rows().rows(); ++cell) {
      if (may_hold_a_keypoint(cell)) fill(cell);
    }
  }

  const DescriptorRows& heat() const { return heat_; }
  float min_probability() const { return min_probability_; }
  bool is_empty(int row, int column) const { return !known_[static_cast<std::size_t>(row) * columns_ + column]; }

  /// The probability there, in whatever cell.
  float at(Eigen::Index v, Eigen::Index u) {
    const Eigen::Index cell = v / kCell * columns_ + u / kCell;
    if (!known_[static_cast<std::size_t>(cell)]) fill(cell);
    return heat_(v, u);
  }

 private:
  /// A pixel's probability is below exp(its logit - that of "none").
  bool may_hold_a_keypoint(Eigen::Index cell) const {
    const float best = logits_.rows().row(cell).head<kLogits - 1>().maxCoeff();
    return !(best - logits_.rows()(cell, kLogits - 1) < lowest_);
  }

  void fill(Eigen::Index cell) {
    Eigen::Array<float, kLogits, 1> odds = logits_.rows().row(cell).transpose().array();
    odds = (odds - odds.maxCoeff()).exp();
    odds /= odds.sum();
    const Eigen::Map<const Eigen::Matrix<float, kCell, kCell, Eigen::RowMajor>> pixels(odds.data());
    heat_.block<kCell, kCell>(cell / columns_ * kCell, cell % columns_ * kCell) = pixels;
    known_[static_cast<std::size_t>(cell)] = true;
  }

  static constexpr float kMargin = 0.1F;  ///< for rounding

  Eigen::Index columns_;
  float min_probability_, lowest_ = std::log(min_probability_) - kMargin;
  CellRows logits_;
  DescriptorRows heat_;
  std::vector<bool> known_;  ///< cells whose probabilities are in heat_
};

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
  explicit Sampler(const XFeatMaps& maps)
      : maps_(maps), descriptors_(CellRows(maps.descriptors, maps.width, maps.descriptors_by_cell).rows()) {
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

Eigen::Vector2f sub_pixel(HeatMap& map, const Peak& peak) {
  Eigen::Vector2f place(static_cast<float>(peak.u), static_cast<float>(peak.v));
  if (peak.u > 0 && peak.u + 1 < map.heat().cols()) {
    place.x() += peak_offset(map.at(peak.v, peak.u - 1), map.at(peak.v, peak.u), map.at(peak.v, peak.u + 1));
  }
  if (peak.v > 0 && peak.v + 1 < map.heat().rows()) {
    place.y() += peak_offset(map.at(peak.v - 1, peak.u), map.at(peak.v, peak.u), map.at(peak.v + 1, peak.u));
  }
  return place;
}

/// In reading order.
std::vector<Peak> find_peaks(const HeatMap& map, int image_width, int image_height) {
  std::vector<Peak> peaks;
  const DescriptorRows& heat = map.heat();
  for (int v = 0; v < image_height; ++v) {
    for (int left = 0; left < image_width; left += kCell) {
      if (map.is_empty(v / kCell, left / kCell)) continue;
      for (int u = left; u < std::min(left + kCell, image_width); ++u) {
        if (heat(v, u) > map.min_probability() && is_peak(heat, v, u)) peaks.push_back({u, v});
      }
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

Features decode_xfeat(const XFeatMaps& maps, int image_width, int image_height, int max_features,
                      float min_probability) {
  HeatMap map(maps, min_probability);
  const std::vector<Peak> peaks = find_peaks(map, image_width, image_height);
  const Sampler sampler(maps);
  std::vector<float> scores;
  scores.reserve(peaks.size());
  for (const Peak& peak : peaks) scores.push_back(map.heat()(peak.v, peak.u) * sampler.reliability(peak.u, peak.v));

  Features features{.image_width = image_width, .image_height = image_height};
  const std::vector<std::size_t> order = strongest(scores, max_features);
  features.descriptors.resize(static_cast<Eigen::Index>(order.size()), maps.width);
  for (const std::size_t i : order) {
    features.descriptors.row(static_cast<Eigen::Index>(features.size())) = sampler.descriptor(peaks[i].u, peaks[i].v);
    features.keypoints.push_back(sub_pixel(map, peaks[i]));
    features.scores.push_back(scores[i]);
  }
  return features;
}

}  // namespace demslam

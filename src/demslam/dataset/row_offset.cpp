#include "demslam/dataset/row_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace demslam {
namespace {

constexpr int kHalf = 5;  // patches of 11 x 11
constexpr int kSide = 2 * kHalf + 1;
constexpr int kArea = kSide * kSide;
constexpr int kRowRange = 8;
constexpr int kGridStep = 48;
constexpr double kLeastDeviation = 6.0;  // grey values; flatter patches fit anywhere
constexpr double kLeastCorrelation = 0.85;
constexpr double kUniqueness = 0.05;  // by which the best place must beat places further than 2 px away

using Patch = std::array<float, kArea>;

/// The patch around (u, v) with mean 0 and norm 1; nothing when it is flat.
std::optional<Patch> normalised_patch(const Image& image, int u, int v) {
  Patch patch;
  float mean = 0.0F, squares = 0.0F;
  for (int i = 0; i < kArea; ++i) mean += patch[i] = image.at(u - kHalf + i % kSide, v - kHalf + i / kSide);
  mean /= kArea;
  for (float& value : patch) {
    value -= mean;
    squares += value * value;
  }
  const float norm = std::sqrt(squares);
  if (norm < kLeastDeviation * kSide) return std::nullopt;
  for (float& value : patch) value /= norm;
  return patch;
}

float correlation(const Patch& patch, const Image& image, int u, int v) {
  float product = 0.0F, sum = 0.0F, squares = 0.0F;
  for (int row = 0; row < kSide; ++row) {
    const std::uint8_t* pixel = &image.pixels[static_cast<std::size_t>(v - kHalf + row) * image.width + (u - kHalf)];
    for (int column = 0; column < kSide; ++column) {
      const float value = pixel[column];
      product += patch[row * kSide + column] * value;
      sum += value;
      squares += value * value;
    }
  }
  const float variance = squares - sum * sum / kArea;
  return variance > 1.0F ? product / std::sqrt(variance) : 0.0F;
}

/// Correlations of one patch over disparities and row differences.
class Search {
 public:
  Search(const Patch& patch, const Image& right, int u, int v)
      : disparities_(std::min(right.width / 4, u - kHalf) + 1) {
    scores_.reserve(static_cast<std::size_t>(disparities_) * (2 * kRowRange + 1));
    for (int dv = -kRowRange; dv <= kRowRange; ++dv) {
      for (int d = 0; d < disparities_; ++d) scores_.push_back(correlation(patch, right, u - d, v + dv));
    }
  }

  /// The row difference of the best place, if it is good, alone and not at the search's edge.
  std::optional<double> row_difference_px() const {
    const auto best = std::max_element(scores_.begin(), scores_.end());
    const int at = static_cast<int>(best - scores_.begin());
    const int d = at % disparities_, dv = at / disparities_ - kRowRange;
    if (*best < kLeastCorrelation || std::abs(dv) == kRowRange || *best - best_elsewhere(d, dv) < kUniqueness) {
      return std::nullopt;
    }
    const double before = score(d, dv - 1), after = score(d, dv + 1);
    const double curvature = before - 2.0 * *best + after;
    return dv + (curvature < 0.0 ? 0.5 * (before - after) / curvature : 0.0);
  }

 private:
  float score(int d, int dv) const { return scores_[static_cast<std::size_t>(dv + kRowRange) * disparities_ + d]; }

  float best_elsewhere(int best_d, int best_dv) const {
    float best = -1.0F;
    for (int dv = -kRowRange; dv <= kRowRange; ++dv) {
      for (int d = 0; d < disparities_; ++d) {
        if (std::abs(d - best_d) > 2 || std::abs(dv - best_dv) > 2) best = std::max(best, score(d, dv));
      }
    }
    return best;
  }

  int disparities_;
  std::vector<float> scores_;
};

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::vector<double> row_differences_px(const Image& left, const Image& right) {
  constexpr int kMargin = kHalf + kRowRange;
  std::vector<double> differences;
  for (int v = kMargin; v < left.height - kMargin; v += kGridStep) {
    for (int u = kMargin; u < left.width - kMargin; u += kGridStep) {
      const auto patch = normalised_patch(left, u, v);
      if (!patch) continue;
      if (const auto difference = Search(*patch, right, u, v).row_difference_px()) differences.push_back(*difference);
    }
  }
  return differences;
}

RowOffset row_offset(std::vector<double> differences_px) {
  if (differences_px.empty()) return {};
  RowOffset result{.patches = differences_px.size(), .offset_px = median_of(differences_px)};
  for (double& difference : differences_px) difference = std::abs(difference - result.offset_px);
  result.spread_px = 1.4826 * median_of(differences_px);
  return result;
}

}  // namespace demslam

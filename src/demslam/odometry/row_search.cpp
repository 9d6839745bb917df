#include "demslam/odometry/row_search.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace demslam {
namespace {

constexpr int kWidth = 16, kHeight = 11;  // patch, pixels; a row of 16 bytes is one vector instruction
constexpr int kLeftOf = kWidth / 2, kAbove = kHeight / 2;
constexpr int kClip = 63;
constexpr int kNeighbourhood = 2;  // shifts this near the best are the best itself

/// Sum of absolute differences of two patches.
#if defined(__SSE2__)
int patch_cost(const std::uint8_t* a, const std::uint8_t* b, int stride) {
  __m128i sum = _mm_setzero_si128();
  for (int row = 0; row < kHeight; ++row, a += stride, b += stride) {
    const __m128i row_a = _mm_loadu_si128(reinterpret_cast<const __m128i*>(a));
    const __m128i row_b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(b));
    sum = _mm_add_epi64(sum, _mm_sad_epu8(row_a, row_b));
  }
  return _mm_cvtsi128_si32(sum) + _mm_extract_epi16(sum, 4);
}
#else
int patch_cost(const std::uint8_t* a, const std::uint8_t* b, int stride) {
  int cost = 0;
  for (int row = 0; row < kHeight; ++row, a += stride, b += stride) {
    for (int i = 0; i < kWidth; ++i) cost += std::abs(static_cast<int>(a[i]) - static_cast<int>(b[i]));
  }
  return cost;
}
#endif

const std::uint8_t* patch_at(const Image& image, int u, int v) {
  return image.pixels.data() + static_cast<std::size_t>(v - kAbove) * image.width + (u - kLeftOf);
}

int lowest_elsewhere(const std::vector<int>& costs, int best) {
  int lowest = std::numeric_limits<int>::max();
  for (int i = 0; i < static_cast<int>(costs.size()); ++i) {
    if (std::abs(i - best) > kNeighbourhood) lowest = std::min(lowest, costs[i]);
  }
  return lowest;
}

}  // namespace

Image gradient_image(const Image& image) {
  Image gradient(image.width, image.height, 128);
  for (int v = 1; v + 1 < image.height; ++v) {
    for (int u = 1; u + 1 < image.width; ++u) {
      const int slope = (image.at(u + 1, v - 1) - image.at(u - 1, v - 1)) +
                        2 * (image.at(u + 1, v) - image.at(u - 1, v)) +
                        (image.at(u + 1, v + 1) - image.at(u - 1, v + 1));
      gradient.at(u, v) = static_cast<std::uint8_t>(128 + std::clamp(slope, -kClip, kClip));
    }
  }
  return gradient;
}

RowSearch::Result RowSearch::search(int u, int v, int first_shift, int last_shift, std::vector<int>& costs) const {
  const int right_margin = kWidth - kLeftOf;
  if (v < kAbove || v + kAbove >= reference_.height || u < kLeftOf || u + right_margin > reference_.width) return {};
  first_shift = std::max(first_shift, kLeftOf - u);
  last_shift = std::min(last_shift, other_.width - right_margin - u);
  if (first_shift > last_shift) return {};

  costs.clear();
  const std::uint8_t* reference = patch_at(reference_, u, v);
  for (int shift = first_shift; shift <= last_shift; ++shift) {
    costs.push_back(patch_cost(reference, patch_at(other_, u + shift, v), reference_.width));
  }
  const int best = static_cast<int>(std::ranges::min_element(costs) - costs.begin());
  const double elsewhere = lowest_elsewhere(costs, best);
  return {.shift_px = first_shift + best, .uniqueness = (costs[best] + 1.0) / (elsewhere + 1.0), .found = true};
}

}  // namespace demslam

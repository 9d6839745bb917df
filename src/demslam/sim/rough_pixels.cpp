#include "demslam/sim/rough_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace demslam {
namespace {

constexpr float kContrast = 0.25F, kDarkest = 0.1F;  // of the brighter one, and of the image's mean
constexpr float kUnbroken = 0.005F;                  // ground bends by less from pixel to pixel, relative to its depth
constexpr std::size_t kBlock = 4;                    // pixels whose rays stay together

using Kind = RoughPixel::Kind;
constexpr std::size_t kKinds = static_cast<std::size_t>(Kind::shadowed) + 1;

/// 1 for the pixels that differ from a neighbour in brightness.
std::vector<std::uint8_t> differing(const Rendering& image) {
  const std::vector<float>& radiance = image.radiance;
  const double sum = std::accumulate(radiance.begin(), radiance.end(), 0.0);
  const float floor = kDarkest * static_cast<float>(sum / static_cast<double>(radiance.size()));
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::uint8_t> differs(radiance.size(), 0);
  const auto compare = [&](std::size_t a, std::size_t b) {
    const float least = kContrast * (std::max(radiance[a], radiance[b]) + floor);
    const std::uint8_t shows = std::abs(radiance[a] - radiance[b]) > least ? 1 : 0;
    differs[a] |= shows;
    differs[b] |= shows;
  };
  for (std::size_t row = 0; row < radiance.size(); row += width) {
    for (std::size_t i = row + 1; i < row + width; ++i) compare(i - 1, i);
    for (std::size_t i = row; i < row + width && row > 0; ++i) compare(i - width, i);
  }
  return differs;
}

/// The inverse depth of a plane is linear over the image: whether it is so from one neighbour to the opposite one.
bool is_straight(const Rendering& image, std::size_t before, std::size_t pixel, std::size_t after) {
  const float middle = 1.0F / image.depth_m[pixel];
  return std::abs(1.0F / image.depth_m[before] + 1.0F / image.depth_m[after] - 2.0F * middle) < kUnbroken * middle;
}

Kind kind_of(const Rendering& image, const std::vector<CentreHit>& centres, std::size_t pixel) {
  const auto width = static_cast<std::size_t>(image.width), u = pixel % width, v = pixel / width;
  if (u == 0 || v == 0 || u + 1 == width || v + 1 == static_cast<std::size_t>(image.height)) return Kind::traced;
  bool any_light = false, any_shadow = false;
  for (const std::size_t i : {pixel, pixel - 1, pixel + 1, pixel - width, pixel + width}) {
    if (centres[i].level == CentreHit::kNoGround) return Kind::traced;
    any_light |= centres[i].sun == Sunlight::lit || centres[i].sun == Sunlight::partly;
    any_shadow |= centres[i].sun == Sunlight::shadowed || centres[i].sun == Sunlight::partly;
  }
  if (any_light == any_shadow || !is_straight(image, pixel - 1, pixel, pixel + 1) ||
      !is_straight(image, pixel - width, pixel, pixel + width)) {
    return Kind::traced;
  }
  return any_light ? Kind::lit : Kind::shadowed;
}

}  // namespace

std::vector<RoughPixel> rough_pixels(const Rendering& image, const std::vector<CentreHit>& centres) {
  const std::vector<std::uint8_t> differs = differing(image);
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  std::array<std::vector<RoughPixel>, kKinds> of_kind;
  const auto add_block = [&](std::size_t top, std::size_t left) {
    for (std::size_t v = top; v < std::min(top + kBlock, height); ++v) {
      for (std::size_t i = v * width + left; i < v * width + std::min(left + kBlock, width); ++i) {
        if (differs[i] == 0) continue;
        const Kind kind = kind_of(image, centres, i);
        of_kind[static_cast<std::size_t>(kind)].push_back({i, kind});
      }
    }
  };
  for (std::size_t top = 0; top < height; top += kBlock) {
    for (std::size_t left = 0; left < width; left += kBlock) add_block(top, left);
  }
  std::vector<RoughPixel> rough;
  for (const auto& pixels : of_kind) rough.insert(rough.end(), pixels.begin(), pixels.end());
  return rough;
}

float plane_depth(const Rendering& image, std::size_t pixel, double du, double dv) {
  const auto inverse = [&](std::size_t i) { return 1.0F / image.depth_m[i]; };
  const auto width = static_cast<std::size_t>(image.width);
  const float along = 0.5F * (inverse(pixel + 1) - inverse(pixel - 1));
  const float down = 0.5F * (inverse(pixel + width) - inverse(pixel - width));
  return 1.0F / (inverse(pixel) + static_cast<float>(du) * along + static_cast<float>(dv) * down);
}

}  // namespace demslam

#include "demslam/features/classical_extractor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/features/image_filters.h"

namespace demslam {
namespace {

constexpr int kBorderPx = 10;          // nearer to the edge a corner has less than half of its descriptor's patch
constexpr int kCellPx = 32;            // corners take turns by cell, so that rocks do not starve the regolith
constexpr float kMinResponse = 0.02F;  // about what one grey level of noise gives
constexpr int kGrid = 4;               // descriptor: kGrid x kGrid sums of directions
constexpr float kGridStepPx = 6.0F;
constexpr int kWidth = ClassicalExtractor::kDescriptorWidth;
static_assert(kWidth == kGrid * kGrid * kDirections);

struct Corner {
  float u, v, response;
  int turn = 0;  ///< how many stronger corners its cell has
};

/// Largest of its 5x5 neighbourhood; of equal ones the first in reading order.
bool is_peak(const Plane& response, int u, int v) {
  const float centre = response.row(v)[u];
  for (int dv = -2; dv <= 2; ++dv) {
    for (int du = -2; du <= 2; ++du) {
      const float other = response.row(v + dv)[u + du];
      const bool earlier = dv < 0 || (dv == 0 && du < 0);
      if (other > centre || (earlier && other == centre)) return false;
    }
  }
  return true;
}

/// Where the second-order expansion of the response around a peak has its top: oblique ridges need the mixed
/// derivative.
Corner corner_at(const Plane& response, int u, int v) {
  const float *above = response.row(v - 1) + u, *row = response.row(v) + u, *below = response.row(v + 1) + u;
  const float du = 0.5F * (row[1] - row[-1]), dv = 0.5F * (below[0] - above[0]);
  const float duu = row[1] - 2.0F * row[0] + row[-1], dvv = below[0] - 2.0F * row[0] + above[0];
  const float duv = 0.25F * (below[1] - below[-1] - above[1] + above[-1]);
  const float determinant = duu * dvv - duv * duv;
  const float step_u = (duv * dv - dvv * du) / determinant, step_v = (duv * du - duu * dv) / determinant;
  const bool sound = determinant > 0.0F && std::max(std::abs(step_u), std::abs(step_v)) < 1.0F;
  return {static_cast<float>(u) + (sound ? step_u : 0.0F), static_cast<float>(v) + (sound ? step_v : 0.0F), row[0]};
}

std::vector<Corner> find_corners(const Plane& response) {
  std::vector<Corner> corners;
  for (int v = kBorderPx; v < response.height - kBorderPx; ++v) {
    const float* row = response.row(v);
    for (int u = kBorderPx; u < response.width - kBorderPx; ++u) {
      if (row[u] < kMinResponse || row[u] < row[u - 1] || row[u] < row[u + 1]) continue;
      if (is_peak(response, u, v)) corners.push_back(corner_at(response, u, v));
    }
  }
  return corners;
}

/// The strongest corner of every cell, then the second of every cell, and so on, until `count` are taken.
std::vector<Corner> spread(std::vector<Corner> corners, int image_width, int image_height, std::size_t count) {
  std::stable_sort(corners.begin(), corners.end(), [](auto& a, auto& b) { return a.response > b.response; });
  const int columns = image_width / kCellPx + 1, rows = image_height / kCellPx + 1;
  std::vector<int> taken(static_cast<std::size_t>(columns) * rows, 0);
  for (Corner& corner : corners) {
    corner.turn = taken[static_cast<int>(corner.v) / kCellPx * columns + static_cast<int>(corner.u) / kCellPx]++;
  }
  std::stable_sort(corners.begin(), corners.end(), [](auto& a, auto& b) { return a.turn < b.turn; });
  corners.resize(std::min(corners.size(), count));
  return corners;
}

using Directions = Eigen::Array<float, kDirections, 1>;

/// The directions at a real place of the grid, bilinear, clamped to the grid.
Directions sample(const Plane& directions, float i, float j) {
  const float x = std::clamp(i, 0.0F, static_cast<float>(directions.width - 1));
  const float y = std::clamp(j, 0.0F, static_cast<float>(directions.height - 1));
  const int x0 = std::min(static_cast<int>(x), directions.width - 2),
            y0 = std::min(static_cast<int>(y), directions.height - 2);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const float* corner = directions.row(y0) + x0 * kDirections;
  const auto at = [&](std::size_t offset) { return Eigen::Map<const Directions>(corner + offset); };
  const Directions above = (1.0F - fx) * at(0) + fx * at(kDirections);
  const std::size_t next = directions.row_size();
  const Directions below = (1.0F - fx) * at(next) + fx * at(next + kDirections);
  return (1.0F - fy) * above + fy * below;
}

/// The root of the relative sums: its dot product is the Hellinger kernel (Arandjelovic and Zisserman 2012).
void describe(const Plane& directions, const Corner& corner, float* descriptor) {
  constexpr std::array<float, kGrid> weights{0.755F, 0.969F, 0.969F, 0.755F};  // a Gaussian of sigma 2 grid steps
  Eigen::Map<Eigen::Array<float, kWidth, 1>> all(descriptor);
  for (int r = 0; r < kGrid; ++r) {
    for (int c = 0; c < kGrid; ++c) {
      const float u = corner.u + (static_cast<float>(c) - 1.5F) * kGridStepPx;
      const float v = corner.v + (static_cast<float>(r) - 1.5F) * kGridStepPx;
      all.segment<kDirections>((r * kGrid + c) * kDirections) =
          weights[r] * weights[c] * sample(directions, 0.5F * u - 0.25F, 0.5F * v - 0.25F);
    }
  }
  all = (all / std::max(all.sum(), 1e-12F)).sqrt();
  all /= std::max(all.matrix().norm(), 1e-12F);
}

}  // namespace

Features ClassicalExtractor::extract(const Image& image) {
  Features features{.image_width = image.width, .image_height = image.height};
  if (std::min(image.width, image.height) <= 2 * kBorderPx) return features;
  const Plane smoothed = smooth(image), directions = gradient_directions(smoothed);
  const std::vector<Corner> corners =
      spread(find_corners(corner_response(smoothed)), image.width, image.height, max_features_);
  features.descriptors.resize(static_cast<Eigen::Index>(corners.size()), kWidth);
  for (const Corner& corner : corners) {
    describe(directions, corner, features.descriptors.row(static_cast<Eigen::Index>(features.size())).data());
    features.keypoints.emplace_back(corner.u, corner.v);
    features.scores.push_back(corner.response);
  }
  return features;
}

}  // namespace demslam

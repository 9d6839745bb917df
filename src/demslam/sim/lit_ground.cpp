#include "demslam/sim/lit_ground.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "demslam/sim/illumination.h"

namespace demslam {
namespace {

constexpr int kHalfWidth = 3;    // of the running mean, cells
constexpr float kAbove = 0.02F;  // shadow rays start so far over the ground, metres

/// Running mean along one axis: `stride` from value to value, `next` from line to line; cut at the ends.
void average_lines(std::vector<float>& values, int count, int stride, int next) {
  std::vector<float> line(count);
  for (int k = 0; k < count; ++k) {
    float* first = values.data() + static_cast<std::ptrdiff_t>(k) * next;
    for (int i = 0; i < count; ++i) line[i] = first[i * stride];
    for (int i = 0; i < count; ++i) {
      const int low = std::max(i - kHalfWidth, 0), high = std::min(i + kHalfWidth, count - 1);
      float sum = 0.0F;
      for (int j = low; j <= high; ++j) sum += line[j];
      first[i * stride] = sum / static_cast<float>(high - low + 1);
    }
  }
}

}  // namespace

void LitGround::build(const Clipmap& clipmap, RTCScene scene, const Eigen::Vector3f& sun) {
  const Eigen::Vector2f middle = (clipmap.centre() - clipmap.origin().head<2>()).cast<float>();
  west_ = middle.x() - 0.5F * kCell * (kCells - 1);
  south_ = middle.y() - 0.5F * kCell * (kCells - 1);
  light_.assign(static_cast<std::size_t>(kCells) * kCells, 0.0F);
  tbb::parallel_for(0, kCells, [&](int row) { light_row(clipmap, scene, sun, row); });
  average_lines(light_, kCells, 1, kCells);
  average_lines(light_, kCells, kCells, 1);
}

/// Irradiance of the cells' middles, relative to level ground.
void LitGround::light_row(const Clipmap& clipmap, RTCScene scene, const Eigen::Vector3f& sun, int row) {
  for (int first = 0; first < kCells; first += kPacket) {
    alignas(64) int valid[kPacket];
    alignas(64) RTCRay16 rays;
    float cosine[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      const Eigen::Vector2f place(west_ + kCell * static_cast<float>(first + i),
                                  south_ + kCell * static_cast<float>(row));
      const Clipmap::Ground ground = clipmap.ground(place.x(), place.y());
      const Eigen::Vector3f normal = Eigen::Vector3f(-ground.slope_x, -ground.slope_y, 1.0F).normalized();
      cosine[i] = normal.dot(sun);
      valid[i] = cosine[i] > 0.0F ? -1 : 0;
      set_ray(rays, i, Eigen::Vector3f(place.x(), place.y(), ground.height) + kAbove * normal, sun, 0.0F,
              std::numeric_limits<float>::infinity());
    }
    cast_shadows(scene, valid, rays);
    float* light = light_.data() + static_cast<std::size_t>(row) * kCells + first;
    for (int i = 0; i < kPacket; ++i) {
      if (valid[i] != 0 && rays.tfar[i] >= 0.0F) light[i] = cosine[i] / sun.z();
    }
  }
}

float LitGround::at(float x, float y) const {
  constexpr float kLast = kCells - 1.001F;
  const float col = std::clamp((x - west_) / kCell, 0.0F, kLast), row = std::clamp((y - south_) / kCell, 0.0F, kLast);
  const auto ix = static_cast<int>(col), iy = static_cast<int>(row);
  const float tx = col - static_cast<float>(ix), ty = row - static_cast<float>(iy);
  const float* south = light_.data() + static_cast<std::size_t>(iy) * kCells + ix;
  const float* north = south + kCells;
  return (1.0F - ty) * (south[0] + tx * (south[1] - south[0])) + ty * (north[0] + tx * (north[1] - north[0]));
}

}  // namespace demslam

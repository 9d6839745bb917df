#include "demslam/sim/clipmap.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace demslam {
namespace {

constexpr double kOriginStep = 64.0;
constexpr int kStripRows = 16;  // rows of a level that are evaluated at once

std::int64_t snapped(double position, double step_m, int cells) {
  const int snap = cells / 4;
  return static_cast<std::int64_t>(std::llround(position / (snap * step_m))) * snap - cells / 2;
}

double curvature_drop(double east, double north) {
  const double distance = std::sqrt(east * east + north * north);
  const double beyond = distance - Clipmap::kFlat;
  return beyond <= 0.0 ? 0.0 : beyond * beyond / (2.0 * Clipmap::kRadius);
}

/// Position on a level's lattice: the node to the south-west and the fractions from it, kept inside the level.
struct Node {
  std::size_t index;
  float tx, ty;
};

Node node_at(int cells, float east, float north) {
  const float limit = static_cast<float>(cells) - 1e-3F;
  const float col = std::clamp(east, 0.0F, limit), row = std::clamp(north, 0.0F, limit);
  const auto ix = static_cast<int>(col), iy = static_cast<int>(row);
  return {static_cast<std::size_t>(iy) * (cells + 1) + ix, col - static_cast<float>(ix), row - static_cast<float>(iy)};
}

template <class Get>
float bilinear(const Node& node, int stride, const Get& get) {
  const float south = get(node.index) * (1.0F - node.tx) + get(node.index + 1) * node.tx;
  const float north = get(node.index + stride) * (1.0F - node.tx) + get(node.index + stride + 1) * node.tx;
  return south * (1.0F - node.ty) + north * node.ty;
}

}  // namespace

Clipmap::Clipmap(const Terrain& terrain, int cells, double range_m) : terrain_(terrain), cells_(cells) {
  for (double step = Terrain::kFinestStep; levels_.empty() || levels_.back().step_m * cells_ < 2.0 * range_m;
       step *= 2.0) {
    levels_.emplace_back().step_m = step;
  }
}

bool Clipmap::move_origin(const Eigen::Vector2d& position) {
  const Eigen::Vector2d snapped_place = (position / kOriginStep).array().round() * kOriginStep;
  if (snapped_place == origin_.head<2>()) return false;
  Patch point(snapped_place.x(), snapped_place.y(), terrain_.base().cell_m(), 1, 1);
  terrain_.base().add_to(point);
  origin_ = Eigen::Vector3d(snapped_place.x(), snapped_place.y(), std::round(point.values.front()));
  return true;
}

bool Clipmap::centre_on(const Eigen::Vector2d& position) {
  const bool everything = move_origin(position), ground_changed = terrain_.revision() != ground_;
  ground_ = terrain_.revision();
  std::vector<bool> moved(levels_.size(), everything);
  for (std::size_t k = levels_.size(); k-- > 0;) {
    Level& level = levels_[k];
    const std::int64_t first_x = snapped(position.x(), level.step_m, cells_);
    const std::int64_t first_y = snapped(position.y(), level.step_m, cells_);
    moved[k] = everything || (ground_changed && level.step_m <= GroundLayer::kFinest) || first_x != level.first_x ||
               first_y != level.first_y;
    if (!moved[k]) continue;
    level.first_x = first_x;
    level.first_y = first_y;
    build(level, k + 1 < levels_.size() ? &levels_[k + 1] : nullptr);
  }
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    if (moved[k] || (k > 0 && moved[k - 1])) cut_blocks(k);
  }
  return std::find(moved.begin(), moved.end(), true) != moved.end();
}

Eigen::Vector2d Clipmap::centre() const {
  const Level& finest = levels_.front();
  return finest.step_m * Eigen::Vector2d(finest.first_x + cells_ / 2, finest.first_y + cells_ / 2);
}

void Clipmap::build(Level& level, const Level* coarser) const {
  const int nodes = cells_ + 1;
  level.vertices.resize(static_cast<std::size_t>(nodes) * nodes + 1);  // one more: Embree reads 16 bytes a vertex
  level.shades.resize(static_cast<std::size_t>(nodes) * nodes);
  const double step = level.step_m, centre_x = (level.first_x + cells_ / 2) * step,
               centre_y = (level.first_y + cells_ / 2) * step;
  tbb::parallel_for(0, (nodes + kStripRows - 1) / kStripRows, [&](int strip) {
    const int first = strip * kStripRows, rows = std::min(kStripRows, nodes - first);
    Patch heights((level.first_x - 1) * step, (level.first_y + first - 1) * step, step, nodes + 2, rows + 2);
    Patch albedo(level.first_x * step, (level.first_y + first) * step, step, nodes, rows);
    terrain_.fill(heights);
    terrain_.fill_albedo(albedo);
    for (int row = 0; row < rows; ++row) {
      const double y = albedo.y(row);
      const double *mid = heights.row(row + 1), *south = heights.row(row), *north = heights.row(row + 2);
      for (int col = 0; col < nodes; ++col) {
        const double x = albedo.x(col), drop = curvature_drop(x - centre_x, y - centre_y);
        const std::size_t i = static_cast<std::size_t>(first + row) * nodes + col;
        level.vertices[i] = {static_cast<float>(x - origin_.x()), static_cast<float>(y - origin_.y()),
                             static_cast<float>(mid[col + 1] - drop - origin_.z())};
        level.shades[i] = {static_cast<float>((mid[col + 2] - mid[col]) / (2.0 * step)),
                           static_cast<float>((north[col + 1] - south[col + 1]) / (2.0 * step)),
                           static_cast<float>(albedo.at(col, row))};
      }
    }
  });
  if (coarser != nullptr) blend_edge(level, *coarser);
}

/// Over the outer block of a level, heights and slopes go over into the coarser level's, which they equal at the edge.
void Clipmap::blend_edge(Level& level, const Level& coarser) const {
  const int nodes = cells_ + 1;
  for (int row = 0; row < nodes; ++row) {
    for (int col = 0; col < nodes; ++col) {
      const int inset = std::min({row, col, cells_ - row, cells_ - col});
      if (inset >= block()) {
        col = cells_ - block();
        continue;
      }
      const auto weight = static_cast<float>(1.0 - smooth_step(0.0, block(), inset));
      const float east = 0.5F * static_cast<float>(level.first_x + col - 2 * coarser.first_x);
      const float north = 0.5F * static_cast<float>(level.first_y + row - 2 * coarser.first_y);
      const Node node = node_at(cells_, east, north);
      const std::size_t i = static_cast<std::size_t>(row) * nodes + col;
      const auto mix = [&](float& value, const auto& get) { value += weight * (bilinear(node, nodes, get) - value); };
      mix(level.vertices[i].z, [&](std::size_t k) { return coarser.vertices[k].z; });
      mix(level.shades[i].slope_x, [&](std::size_t k) { return coarser.shades[k].slope_x; });
      mix(level.shades[i].slope_y, [&](std::size_t k) { return coarser.shades[k].slope_y; });
      mix(level.shades[i].albedo, [&](std::size_t k) { return coarser.shades[k].albedo; });
    }
  }
}

/// Lists the blocks of a level around the hole in which the finer level lies.
void Clipmap::cut_blocks(std::size_t index) {
  Level& level = levels_[index];
  const int per_side = cells_ / block();
  int hole_row = per_side, hole_col = per_side;  // the finest level has none
  if (index > 0) {
    hole_row = static_cast<int>((levels_[index - 1].first_y / 2 - level.first_y) / block());
    hole_col = static_cast<int>((levels_[index - 1].first_x / 2 - level.first_x) / block());
  }
  const auto in_hole = [per_side](int at, int hole) { return at >= hole && at < hole + per_side / 2; };
  level.blocks.clear();
  for (int row = 0; row < per_side; ++row) {
    for (int col = 0; col < per_side; ++col) {
      if (!in_hole(row, hole_row) || !in_hole(col, hole_col)) level.blocks.push_back({row, col});
    }
  }
  ++level.revision;
}

std::uint64_t Clipmap::revision(std::size_t first) const {
  std::uint64_t sum = 0;
  for (std::size_t k = first; k < levels_.size(); ++k) sum += levels_[k].revision;
  return sum;
}

Clipmap::Shade Clipmap::shade(int index, float x, float y) const {
  const Level& level = levels_[index];
  const auto per_step = static_cast<float>(1.0 / level.step_m);
  const Vertex& corner = level.vertices.front();
  const Node node = node_at(cells_, (x - corner.x) * per_step, (y - corner.y) * per_step);
  const int stride = cells_ + 1;
  return {bilinear(node, stride, [&](std::size_t k) { return level.shades[k].slope_x; }),
          bilinear(node, stride, [&](std::size_t k) { return level.shades[k].slope_y; }),
          bilinear(node, stride, [&](std::size_t k) { return level.shades[k].albedo; })};
}

Clipmap::Ground Clipmap::ground(float x, float y) const {
  for (const Level& level : levels_) {
    const auto per_step = static_cast<float>(1.0 / level.step_m), last = static_cast<float>(cells_);
    const float east = (x - level.vertices.front().x) * per_step, north = (y - level.vertices.front().y) * per_step;
    if (east < 0.0F || north < 0.0F || east > last || north > last) continue;
    const Node node = node_at(cells_, east, north);
    const auto between = [&](const auto& get) { return bilinear(node, cells_ + 1, get); };
    return {between([&](std::size_t k) { return level.vertices[k].z; }),
            between([&](std::size_t k) { return level.shades[k].slope_x; }),
            between([&](std::size_t k) { return level.shades[k].slope_y; })};
  }
  return {};
}

double Clipmap::shown_height(const Eigen::Vector2d& position) const {
  for (const Level& level : levels_) {
    const double east = position.x() / level.step_m - level.first_x,
                 north = position.y() / level.step_m - level.first_y;
    if (east < 0.0 || north < 0.0 || east > cells_ || north > cells_) continue;
    const Node node = node_at(cells_, static_cast<float>(east), static_cast<float>(north));
    return origin_.z() + bilinear(node, cells_ + 1, [&](std::size_t k) { return level.vertices[k].z; });
  }
  return terrain_.height(position.x(), position.y());
}

}  // namespace demslam

#include "demslam/graph/keyframe_grid.h"

#include <cmath>

namespace demslam {
namespace {

std::int64_t key(std::int64_t column, std::int64_t row) { return (column << 32) ^ (row & 0xffffffffLL); }

}  // namespace

std::int64_t KeyframeGrid::index(double coordinate_m) const {
  return static_cast<std::int64_t>(std::floor(coordinate_m / cell_m_));
}

void KeyframeGrid::add(std::size_t keyframe, const Eigen::Vector2d& position_m) {
  cells_[key(index(position_m.x()), index(position_m.y()))].push_back(keyframe);
}

std::vector<std::size_t> KeyframeGrid::around(const Eigen::Vector2d& position_m, double radius_m) const {
  std::vector<std::size_t> near;
  for (std::int64_t row = index(position_m.y() - radius_m); row <= index(position_m.y() + radius_m); ++row) {
    for (std::int64_t column = index(position_m.x() - radius_m); column <= index(position_m.x() + radius_m); ++column) {
      const auto cell = cells_.find(key(column, row));
      if (cell != cells_.end()) near.insert(near.end(), cell->second.begin(), cell->second.end());
    }
  }
  return near;
}

}  // namespace demslam

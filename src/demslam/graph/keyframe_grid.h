#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace demslam {

/// Keyframes by horizontal position, so that the near ones are found at a cost that does not grow with the path.
class KeyframeGrid {
 public:
  explicit KeyframeGrid(double cell_m) : cell_m_(cell_m) {}

  void clear() { cells_.clear(); }
  void add(std::size_t keyframe, const Eigen::Vector2d& position_m);
  /// Those in cells that touch the square of half-width `radius_m`: all that are nearer than that, and some more.
  std::vector<std::size_t> around(const Eigen::Vector2d& position_m, double radius_m) const;

 private:
  std::int64_t index(double coordinate_m) const;

  double cell_m_;
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells_;
};

}  // namespace demslam

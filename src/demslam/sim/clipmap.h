#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "demslam/sim/terrain.h"

namespace demslam {

/// The terrain as nested square grids around a place, each twice as coarse and twice as wide as the one inside it. The
/// windows depend on the place alone, moving by two blocks at a time, so every visit to a place sees the same surface;
/// towards its outer edge a level turns into the next one, so that the surface has neither cracks nor steps. Memory is
/// constant.
class Clipmap {
 public:
  static constexpr double kRadius = 1737400.0;  ///< of the Moon; the ground beyond kFlat falls off with its curvature
  static constexpr double kFlat = 200.0;        ///< metres

  struct Vertex {
    float x, y, z;  ///< relative to origin()
  };
  struct Shade {
    float slope_x, slope_y, albedo;
  };
  struct Block {
    int row, col;  ///< of blocks
    bool operator==(const Block&) const = default;
  };
  /// One grid of (cells + 1)^2 nodes, west to east, south to north.
  struct Level {
    double step_m = 0.0;
    std::int64_t first_x = 0, first_y = 0;  ///< lattice index of the south-west node: x = first_x * step_m
    std::vector<Vertex> vertices;
    std::vector<Shade> shades;
    std::vector<Block> blocks;   ///< those that the finer level does not cover
    std::uint64_t revision = 0;  ///< counts the changes of vertices or blocks
  };

  /// `cells` per side, a multiple of 128; levels are added until the outermost reaches `range_m`.
  Clipmap(const Terrain& terrain, int cells, double range_m);

  /// Centres the windows on a map position. Returns whether anything changed.
  bool centre_on(const Eigen::Vector2d& position);

  int cells() const { return cells_; }
  int block() const { return cells_ / 8; }  ///< cells; the grid of the holes that finer levels cut into coarser ones
  Eigen::Vector2d centre() const;           ///< of the finest window, map frame
  const std::vector<Level>& levels() const { return levels_; }
  const Eigen::Vector3d& origin() const {
    return origin_;
  }  ///< map frame, moves in large steps (single precision near it)

  /// Grows when a level from `first` on has changed.
  std::uint64_t revision(std::size_t first) const;
  /// Slope and albedo between the nodes of a level at a position relative to origin().
  Shade shade(int level, float x, float y) const;
  /// The surface as it is shown, at a position relative to origin(): of the innermost level that covers it.
  struct Ground {
    float height, slope_x, slope_y;
  };
  Ground ground(float x, float y) const;
  /// Height (map z) of the surface as it is shown: the innermost level that covers the position.
  double shown_height(const Eigen::Vector2d& position) const;

 private:
  bool move_origin(const Eigen::Vector2d& position);
  void build(Level& level, const Level* coarser) const;
  void blend_edge(Level& level, const Level& coarser) const;
  void cut_blocks(std::size_t index);

  const Terrain& terrain_;
  int cells_;
  std::vector<Level> levels_;  ///< finest first
  std::uint64_t ground_ = 0;   ///< the terrain's revision that the levels show
  Eigen::Vector3d origin_ = Eigen::Vector3d::Constant(1e300);
};

}  // namespace demslam

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "demslam/geometry/pose.h"
#include "demslam/sim/route.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// A closed triangle mesh about the origin, of diameter 1, with smooth normals.
struct RockShape {
  std::vector<Eigen::Vector3f> vertices, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// An icosphere of 20 * 4^subdivisions triangles.
RockShape sphere_shape(int subdivisions);

/// An irregular block: a sphere cut by random planes with rounded edges, roughened.
RockShape rock_shape(std::uint64_t seed, int subdivisions);

/// One rock: `shape` is an index into RockField::shapes().
struct Rock {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();  ///< the shape's origin
  Eigen::Quaternionf R_map_rock = Eigen::Quaternionf::Identity();
  float diameter_m = 1.0F;
  float albedo = 1.0F;  ///< relative to the ground
  int shape = 0;
};

/// The rocks of the ground. Sizes follow Golombek's law: the area fraction covered by rocks larger than D is
/// k exp(-q(k) D) with q = 1.79 + 0.152 / k. Where a rock lies and what it looks like depends on the seed and its place
/// alone; rocks too high to drive over keep clear of the route, as a rover's planner would choose it.
class RockField {
 public:
  static constexpr double kSmallest = 0.03;  ///< diameter, metres

  RockField(const TerrainOptions& options, std::uint64_t seed, const Terrain& terrain, const Route& route);

  /// Rocks around a position, each up to `reach_per_diameter` times the low end of its octave of diameters away.
  std::vector<Rock> around(const Eigen::Vector2d& position, double reach_per_diameter);

  /// Number of rocks with diameters in [low, high) per square metre.
  static double density(double abundance, double low_m, double high_m);
  /// Shape 0 is a sphere; the field itself uses the others.
  const std::vector<RockShape>& shapes() const { return shapes_; }

 private:
  struct Cell {
    std::uint64_t octave;
    std::int64_t x, y;
    auto operator<=>(const Cell&) const = default;
  };
  std::vector<Rock> rocks_of(const Cell& cell, double low_m, double high_m) const;

  TerrainOptions options_;
  std::uint64_t seed_;
  const Terrain& terrain_;
  const Route& route_;
  std::vector<RockShape> shapes_;
  std::map<Cell, std::vector<Rock>> cells_;  ///< those in reach, kept from call to call
};

}  // namespace demslam

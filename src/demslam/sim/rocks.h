#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "demslam/geometry/pose.h"
#include "demslam/sim/rock_population.h"
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

/// The rocks of a population as bodies that lie on the terrain, off the route.
class RockField {
 public:
  RockField(const Terrain& terrain, const Route& route);

  /// Rocks around a position, each up to `reach_per_diameter` times the low end of its octave of diameters away.
  std::vector<Rock> around(const Eigen::Vector2d& position, double reach_per_diameter);

  /// Shape 0 is a sphere; the field itself uses the others.
  const std::vector<RockShape>& shapes() const { return shapes_; }

 private:
  using Cells = std::map<RockPopulation::Cell, std::vector<Rock>>;
  std::vector<Rock> rocks_of(const RockPopulation::Octave& octave, const RockPopulation::Cell& cell) const;

  const Terrain& terrain_;
  const Route& route_;
  std::vector<RockShape> shapes_;
  Cells cells_;  ///< those in reach, kept from call to call
};

}  // namespace demslam

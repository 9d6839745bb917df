#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/sim/craters.h"
#include "demslam/sim/route.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// A rock's place on the map and its looks; the ground gives it its height.
struct RockPlace {
  Eigen::Vector2d p_m = Eigen::Vector2d::Zero();
  double diameter_m = 1.0;
  double buried = 0.3;  ///< part of its height below the ground
  Eigen::Quaternionf R_map_rock = Eigen::Quaternionf::Identity();
  float albedo = 1.0F;
  int shape = 1;

  double height_m() const { return 0.7 * diameter_m * (1.0 - buried); }  ///< above the ground
};

/// Where rocks lie. Sizes follow Golombek's law: the area fraction covered by rocks larger than D is k exp(-q(k) D)
/// with q = 1.79 + 0.152 / k. Fresh craters have thrown out more of them: up to twelve times as many at the rim, fading
/// over three radii. A rock depends on the seed and its place alone; those too high to drive over keep off a route.
class RockPopulation {
 public:
  static constexpr double kSmallest = 0.03;        ///< diameter, metres
  static constexpr double kDrivableHeight = 0.12;  ///< metres; lower rocks pass under the rover
  static constexpr int kShapes = 24;

  RockPopulation(const TerrainOptions& options, std::uint64_t seed, const CraterField& fresh);

  /// One square of one octave of diameters [low, high).
  struct Cell {
    std::uint64_t octave;
    std::int64_t x, y;
    auto operator<=>(const Cell&) const = default;
  };
  struct Octave {
    std::uint64_t index;
    double low_m, high_m;
    double side_m() const { return 16.0 * high_m; }
  };
  std::vector<Octave> octaves() const;
  std::vector<Cell> cells_in(const Octave& octave, const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;
  std::vector<RockPlace> in_cell(const Octave& octave, const Cell& cell) const;

  /// All rocks with centres in a rectangle and at least `min_diameter_m`.
  std::vector<RockPlace> within(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double min_diameter_m) const;
  /// Whether a rock lies in the way: too high to drive over, and closer to the route than the clearance.
  bool blocks(const RockPlace& rock, const Route& route) const;
  double largest_m() const { return options_.rock_max_m; }
  double clearance_m(const RockPlace& rock) const { return options_.rock_clearance_m + 0.5 * rock.diameter_m; }

  /// Number of rocks with diameters in [low, high) per square metre, away from fresh craters.
  static double density(double abundance, double low_m, double high_m);

 private:
  std::vector<Crater> craters_near(const Octave& octave, const Cell& cell) const;
  RockPlace draw(Random& random, const Octave& octave, const Cell& cell) const;

  TerrainOptions options_;
  std::uint64_t seed_;
  CraterField fresh_;
};

/// How many times denser rocks lie at a place because of fresh craters; 1 far away.
double ejecta_density(const std::vector<Crater>& fresh, const Eigen::Vector2d& place);

}  // namespace demslam

#include "demslam/sim/rock_population.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/geometry/pose.h"

namespace demslam {
namespace {

constexpr double kEjectaBoost = 11.0, kEjectaReach = 4.0;  // at the rim; crater radii

int poisson(Random& random, double mean) {
  const double limit = std::exp(-mean);
  double product = random.uniform();
  int count = 0;
  for (; product > limit; ++count) product *= random.uniform();
  return count;
}

/// Diameter in [low, high) from the density exp(-q D) / D^2, by rejection from 1 / D^2.
double draw_diameter(Random& random, double q, double low, double high) {
  for (;;) {
    const double diameter = 1.0 / (1.0 / low - random.uniform() * (1.0 / low - 1.0 / high));
    if (random.uniform() <= std::exp(-q * (diameter - low))) return diameter;
  }
}

double golombek_q(double abundance) { return 1.79 + 0.152 / abundance; }

}  // namespace

double ejecta_density(const std::vector<Crater>& fresh, const Eigen::Vector2d& place) {
  double densest = 0.0;
  for (const Crater& crater : fresh) {
    const double radii = 2.0 * (place - Eigen::Vector2d(crater.x_m, crater.y_m)).norm() / crater.diameter_m;
    densest = std::max(densest, 1.0 - smooth_step(1.0, kEjectaReach, radii));
  }
  return 1.0 + kEjectaBoost * densest * densest;
}

RockPopulation::RockPopulation(const TerrainOptions& options, std::uint64_t seed, const CraterField& fresh)
    : options_(options), seed_(Random::mix(seed ^ 0x726f636bULL)), fresh_(fresh) {}

double RockPopulation::density(double abundance, double low_m, double high_m) {
  const double q = golombek_q(abundance);
  const int steps = 64;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double diameter = low_m + (high_m - low_m) * (i + 0.5) / steps;
    sum += std::exp(-q * diameter) / (diameter * diameter);
  }
  return abundance * q * 4.0 / std::numbers::pi * sum * (high_m - low_m) / steps;
}

std::vector<RockPopulation::Octave> RockPopulation::octaves() const {
  std::vector<Octave> all;
  if (options_.rock_abundance <= 0.0) return all;
  for (double low = kSmallest; low < options_.rock_max_m; low *= 2.0) {
    all.push_back({all.size(), low, std::min(2.0 * low, options_.rock_max_m)});
  }
  return all;
}

std::vector<RockPopulation::Cell> RockPopulation::cells_in(const Octave& octave, const Eigen::Vector2d& low,
                                                           const Eigen::Vector2d& high) const {
  const double side = octave.side_m();
  std::vector<Cell> cells;
  for (auto y = static_cast<std::int64_t>(std::floor(low.y() / side)); static_cast<double>(y) * side <= high.y(); ++y) {
    for (auto x = static_cast<std::int64_t>(std::floor(low.x() / side)); static_cast<double>(x) * side <= high.x();
         ++x) {
      cells.push_back({octave.index, x, y});
    }
  }
  return cells;
}

std::vector<Crater> RockPopulation::craters_near(const Octave& octave, const Cell& cell) const {
  const double side = octave.side_m(), reach = 0.5 * kEjectaReach * fresh_.largest_m;
  const double west = static_cast<double>(cell.x) * side, south = static_cast<double>(cell.y) * side;
  std::vector<Crater> near = fresh_.within(west - reach, south - reach, west + side + reach, south + side + reach, 0.0);
  std::erase_if(near, [&](const Crater& crater) {
    const double r = 0.5 * kEjectaReach * crater.diameter_m;
    return crater.x_m + r < west || crater.x_m - r > west + side || crater.y_m + r < south ||
           crater.y_m - r > south + side;
  });
  return near;
}

RockPlace RockPopulation::draw(Random& random, const Octave& octave, const Cell& cell) const {
  RockPlace rock;
  const double u = random.uniform(), v = random.uniform();
  rock.p_m = octave.side_m() * Eigen::Vector2d(static_cast<double>(cell.x) + u, static_cast<double>(cell.y) + v);
  rock.diameter_m = draw_diameter(random, golombek_q(options_.rock_abundance), octave.low_m, octave.high_m);
  rock.shape = 1 + static_cast<int>(random.index(kShapes));
  const double yaw = 2.0 * std::numbers::pi * random.uniform(), lean = 0.35 * random.normal(),
               roll = 0.35 * random.normal();
  rock.R_map_rock = rotation_from_rpy(roll, lean, yaw).cast<float>();
  rock.buried = random.uniform(0.15, 0.6);
  rock.albedo = static_cast<float>(1.15 + 0.15 * random.normal());
  return rock;
}

std::vector<RockPlace> RockPopulation::in_cell(const Octave& octave, const Cell& cell) const {
  Random random(Random::mix(seed_ + cell.octave) + static_cast<std::uint64_t>(cell.x),
                static_cast<std::uint64_t>(cell.y));
  const std::vector<Crater> fresh = craters_near(octave, cell);
  const double densest = fresh.empty() ? 1.0 : 1.0 + kEjectaBoost, side = octave.side_m();
  std::vector<RockPlace> rocks;
  const double mean = density(options_.rock_abundance, octave.low_m, octave.high_m) * side * side;
  for (int left = poisson(random, densest * mean); left > 0; --left) {
    const RockPlace rock = draw(random, octave, cell);
    if (random.uniform() * densest <= ejecta_density(fresh, rock.p_m)) rocks.push_back(rock);
  }
  return rocks;
}

std::vector<RockPlace> RockPopulation::within(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                                              double min_diameter_m) const {
  std::vector<RockPlace> found;
  for (const Octave& octave : octaves()) {
    if (octave.high_m <= min_diameter_m) continue;
    for (const Cell& cell : cells_in(octave, low, high)) {
      for (const RockPlace& rock : in_cell(octave, cell)) {
        const bool inside = (rock.p_m.array() >= low.array()).all() && (rock.p_m.array() <= high.array()).all();
        if (inside && rock.diameter_m >= min_diameter_m) found.push_back(rock);
      }
    }
  }
  return found;
}

bool RockPopulation::blocks(const RockPlace& rock, const Route& route) const {
  return rock.height_m() > kDrivableHeight && route.distance_m(rock.p_m) < clearance_m(rock);
}

}  // namespace demslam

#include "demslam/sim/rocks.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr int kShapes = 24;
constexpr double kCellsPerDiameter = 16.0;
constexpr double kDrivableHeight = 0.12;  // metres; lower rocks pass under the rover

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

RockField::RockField(const TerrainOptions& options, std::uint64_t seed, const Terrain& terrain, const Route& route)
    : options_(options), seed_(Random::mix(seed ^ 0x726f636bULL)), terrain_(terrain), route_(route) {
  shapes_.push_back(sphere_shape(4));
  for (int i = 0; i < kShapes; ++i) shapes_.push_back(rock_shape(Random::mix(seed_ + i), 4));
}

double RockField::density(double abundance, double low_m, double high_m) {
  const double q = golombek_q(abundance);
  const int steps = 64;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double diameter = low_m + (high_m - low_m) * (i + 0.5) / steps;
    sum += std::exp(-q * diameter) / (diameter * diameter);
  }
  return abundance * q * 4.0 / std::numbers::pi * sum * (high_m - low_m) / steps;
}

std::vector<Rock> RockField::around(const Eigen::Vector2d& position, double reach_per_diameter) {
  std::vector<Rock> rocks;
  if (options_.rock_abundance <= 0.0) return rocks;
  std::map<Cell, std::vector<Rock>> kept;
  std::uint64_t octave = 0;
  for (double low = kSmallest; low < options_.rock_max_m; low *= 2.0, ++octave) {
    const double high = std::min(2.0 * low, options_.rock_max_m), side = kCellsPerDiameter * high;
    const double reach = reach_per_diameter * low;
    for (auto y = static_cast<std::int64_t>(std::floor((position.y() - reach) / side));
         y * side <= position.y() + reach; ++y) {
      for (auto x = static_cast<std::int64_t>(std::floor((position.x() - reach) / side));
           x * side <= position.x() + reach; ++x) {
        const Cell cell{octave, x, y};
        auto node = cells_.extract(cell);
        const auto at =
            node ? kept.insert(std::move(node)).position : kept.emplace(cell, rocks_of(cell, low, high)).first;
        rocks.insert(rocks.end(), at->second.begin(), at->second.end());
      }
    }
  }
  cells_ = std::move(kept);
  return rocks;
}

std::vector<Rock> RockField::rocks_of(const Cell& cell, double low_m, double high_m) const {
  const double side = kCellsPerDiameter * high_m;
  Random random(Random::mix(seed_ + cell.octave) + static_cast<std::uint64_t>(cell.x),
                static_cast<std::uint64_t>(cell.y));
  std::vector<Rock> rocks;
  for (int left = poisson(random, density(options_.rock_abundance, low_m, high_m) * side * side); left > 0; --left) {
    Rock rock;
    const double x = (cell.x + random.uniform()) * side, y = (cell.y + random.uniform()) * side;
    const double diameter = draw_diameter(random, golombek_q(options_.rock_abundance), low_m, high_m);
    rock.diameter_m = static_cast<float>(diameter);
    rock.shape = 1 + static_cast<int>(random.index(kShapes));
    const double yaw = 2.0 * std::numbers::pi * random.uniform(), lean = 0.35 * random.normal(),
                 roll = 0.35 * random.normal();
    rock.R_map_rock = rotation_from_rpy(roll, lean, yaw).cast<float>();
    const double buried = random.uniform(0.15, 0.6);
    rock.albedo = static_cast<float>(1.15 + 0.15 * random.normal());
    const double height = 0.7 * diameter * (1.0 - buried);
    if (height > kDrivableHeight && route_.distance_m({x, y}) < options_.rock_clearance_m + 0.5 * diameter) continue;
    rock.p_map = Eigen::Vector3d(x, y, terrain_.height(x, y) + 0.7 * diameter * (0.5 - buried));
    rocks.push_back(rock);
  }
  return rocks;
}

}  // namespace demslam

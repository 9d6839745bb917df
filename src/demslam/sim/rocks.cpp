#include "demslam/sim/rocks.h"

#include <utility>

#include "demslam/base/random.h"

namespace demslam {

RockField::RockField(const Terrain& terrain, const Route& route) : terrain_(terrain), route_(route) {
  shapes_.push_back(sphere_shape(4));
  for (int i = 0; i < RockPopulation::kShapes; ++i) shapes_.push_back(rock_shape(Random::mix(terrain.seed() + i), 4));
}

std::vector<Rock> RockField::around(const Eigen::Vector2d& position, double reach_per_diameter) {
  std::vector<Rock> rocks;
  Cells kept;
  for (const RockPopulation::Octave& octave : terrain_.rocks().octaves()) {
    const Eigen::Vector2d reach = Eigen::Vector2d::Constant(reach_per_diameter * octave.low_m);
    for (const RockPopulation::Cell& cell : terrain_.rocks().cells_in(octave, position - reach, position + reach)) {
      auto node = cells_.extract(cell);
      const auto at = node ? kept.insert(std::move(node)).position : kept.emplace(cell, rocks_of(octave, cell)).first;
      rocks.insert(rocks.end(), at->second.begin(), at->second.end());
    }
  }
  cells_ = std::move(kept);
  return rocks;
}

std::vector<Rock> RockField::rocks_of(const RockPopulation::Octave& octave, const RockPopulation::Cell& cell) const {
  std::vector<Rock> rocks;
  for (const RockPlace& place : terrain_.rocks().in_cell(octave, cell)) {
    if (terrain_.rocks().blocks(place, route_)) continue;
    Rock rock;
    rock.diameter_m = static_cast<float>(place.diameter_m);
    rock.shape = place.shape;
    rock.R_map_rock = place.R_map_rock;
    rock.albedo = place.albedo;
    const double ground = terrain_.ground_height(place.p_m.x(), place.p_m.y());
    rock.p_map << place.p_m, ground + 0.7 * place.diameter_m * (0.5 - place.buried);
    rocks.push_back(rock);
  }
  return rocks;
}

}  // namespace demslam

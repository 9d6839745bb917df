#pragma once

#include <string>
#include <vector>

#include "demslam/experiment/traverse.h"

namespace demslam {

/// A traverse to estimate; its seed is set by the experiment.
struct TerrainScene {
  std::string name;
  TraverseOptions traverse;
};

/// 378 m, 1.19 km and 11 km over highland, mid, mare and flat ground, and the crater loop of 1.03 km.
std::vector<TerrainScene> terrain_scenes();
/// 378 m and 1.19 km of highland and mare, and the loop.
std::vector<TerrainScene> quick_terrain_scenes();
/// 1.19 km over highland and mare while one thing at a time is worse: the DEM's cells, noise, bias and shift, the
/// start.
std::vector<TerrainScene> sensitivity_scenes();

}  // namespace demslam

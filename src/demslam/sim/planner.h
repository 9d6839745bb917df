#pragma once

#include <Eigen/Core>
#include <vector>

#include "demslam/sim/scene.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// A drivable way through the waypoints. First the cheapest path on a grid of 5 m, where a metre costs
/// 1 + (slope / 6 deg)^2, fifty times as much above 15 degrees, and holes of the DEM and the outside of the base
/// surface are forbidden; then, along it, the same on a grid of 1 m, around small craters and rocks, and back in the
/// rover's own tracks where it comes upon them (a metre costs 0.3 of one beside); smoothed. Throws Error when a
/// waypoint cannot be reached.
std::vector<Eigen::Vector2d> plan(const Terrain& terrain, const std::vector<Eigen::Vector2d>& waypoints);

/// The rover's options with a "planned" or "recorded" route replaced by the waypoints of the plan or of the recording;
/// any other route as it is.
RoverOptions with_known_route(const Terrain& terrain, RoverOptions rover);

}  // namespace demslam

#include "demslam/sim/planner.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <queue>
#include <span>
#include <utility>

#include "demslam/base/error.h"
#include "demslam/sim/recorded_route.h"

namespace demslam {
namespace {

using Way = std::vector<Eigen::Vector2d>;

constexpr float kRockCost = 30.0F;
constexpr float kTrackShare = 0.3F;  // what a metre in the rover's own tracks costs of one beside them
constexpr std::size_t kFresh = 60;   // of the newest nodes, which do not count as tracks
constexpr float kForbidden = std::numeric_limits<float>::infinity();

/// One of the two scales on which a way is sought.
struct Scale {
  double grid_m;         ///< spacing of the nodes
  double margin_m;       ///< the way may lead this far around the bounding box of its ends
  double gentle_deg;     ///< slope at which a metre costs twice as much as on the level
  double steep_deg;      ///< above it, fifty times as much
  double half_smooth_m;  ///< half width of the running mean over the finished way
  double keep_m;         ///< distance of the finished way's points
  int fineness;          ///< slopes are taken on a grid finer by this than the nodes
};
constexpr Scale kFar{5.0, 300.0, 6.0, 15.0, 20.0, 10.0, 1};  // hills, large craters
constexpr Scale kNear{1.0, 20.0, 8.0, 15.0, 2.0, 2.0, 2};    // craters from 1.5 m, rocks
constexpr double kLookAhead = 120.0, kCommitted = 80.0;  // metres of the far way that the near search takes at a time

/// Cost per metre at the nodes of a grid.
struct CostMap {
  Patch nodes;
  std::vector<float> cost;

  int node_of(const Eigen::Vector2d& p) const {
    const int ix = std::clamp(static_cast<int>(std::lround((p.x() - nodes.x0) / nodes.step)), 0, nodes.nx - 1);
    const int iy = std::clamp(static_cast<int>(std::lround((p.y() - nodes.y0) / nodes.step)), 0, nodes.ny - 1);
    return iy * nodes.nx + ix;
  }
  Eigen::Vector2d place(int node) const { return {nodes.x(node % nodes.nx), nodes.y(node / nodes.nx)}; }
};

float cost_of_slope(const Scale& scale, double slope_deg) {
  const double gentle = 1.0 + std::pow(slope_deg / scale.gentle_deg, 2);
  return static_cast<float>(slope_deg > scale.steep_deg ? 50.0 * gentle : gentle);
}

CostMap cost_map(const Terrain& terrain, const Scale& scale, const Way& around) {
  const double grid = scale.grid_m;
  Eigen::Vector2d low = around.front(), high = around.front();
  for (const Eigen::Vector2d& p : around) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector2d size = (high - low).array() + 2.0 * scale.margin_m;
  CostMap map{Patch(low.x() - scale.margin_m, low.y() - scale.margin_m, grid, static_cast<int>(size.x() / grid) + 1,
                    static_cast<int>(size.y() / grid) + 1),
              {}};
  const int n = scale.fineness;
  Patch ground(map.nodes.x0, map.nodes.y0, grid / n, n * (map.nodes.nx - 1) + 1, n * (map.nodes.ny - 1) + 1);
  terrain.fill_ground(ground);
  map.cost.assign(map.nodes.values.size(), kForbidden);
  for (int iy = 1; iy + 1 < map.nodes.ny; ++iy) {
    for (int ix = 1; ix + 1 < map.nodes.nx; ++ix) {
      const double x = map.nodes.x(ix), y = map.nodes.y(iy);
      if (!terrain.base().inside(x, y) || terrain.base().is_hole(x, y)) continue;
      const double dx = (ground.at(n * ix + 1, n * iy) - ground.at(n * ix - 1, n * iy)) / (2.0 * ground.step);
      const double dy = (ground.at(n * ix, n * iy + 1) - ground.at(n * ix, n * iy - 1)) / (2.0 * ground.step);
      map.cost[static_cast<std::size_t>(iy) * map.nodes.nx + ix] =
          cost_of_slope(scale, std::atan(std::hypot(dx, dy)) * 180.0 / std::numbers::pi);
    }
  }
  return map;
}

/// Makes the ground around rocks too high to drive over as dear as a steep slope.
void avoid_rocks(const RockPopulation& rocks, CostMap& map) {
  const Patch& nodes = map.nodes;
  const Eigen::Vector2d low = low_corner(nodes, 0.0), high = high_corner(nodes, 0.0);
  for (const RockPlace& rock : rocks.within(low, high, RockPopulation::kDrivableHeight)) {
    if (rock.height_m() <= RockPopulation::kDrivableHeight) continue;
    const double reach = rocks.clearance_m(rock) + 0.5 * nodes.step;
    const NodeSpan columns = nodes_between(nodes.x0, nodes.step, nodes.nx, rock.p_m.x() - reach, rock.p_m.x() + reach);
    const NodeSpan rows = nodes_between(nodes.y0, nodes.step, nodes.ny, rock.p_m.y() - reach, rock.p_m.y() + reach);
    for (int iy = rows.first; iy <= rows.last; ++iy) {
      for (int ix = columns.first; ix <= columns.last; ++ix) {
        if ((Eigen::Vector2d(nodes.x(ix), nodes.y(iy)) - rock.p_m).norm() > reach) continue;
        map.cost[static_cast<std::size_t>(iy) * nodes.nx + ix] += kRockCost;
      }
    }
  }
}

/// Makes the ground of the way so far cheaper: who comes back follows the own tracks.
void prefer_tracks(const Way& way, CostMap& map) {
  const Patch& nodes = map.nodes;
  const std::size_t old = way.size() - std::min(way.size(), kFresh);
  std::vector<int> tracks;
  for (const Eigen::Vector2d& p : std::span(way).first(old)) {
    const int node = map.node_of(p);
    if ((map.place(node) - p).norm() < nodes.step) tracks.push_back(node);  // else the map ends before it
  }
  std::ranges::sort(tracks);
  tracks.erase(std::ranges::unique(tracks).begin(), tracks.end());
  for (const int node : tracks) map.cost[node] *= kTrackShare;
}

[[noreturn]] void unreachable(const Eigen::Vector2d& goal) {
  char text[120];
  std::snprintf(text, sizeof text, "no way leads to the waypoint x = %.1f m, y = %.1f m; move it", goal.x(), goal.y());
  throw Error(text);
}

/// Nodes from `start` to `goal` by Dijkstra's method over the eight neighbours; empty: there is no way.
std::vector<int> cheapest(const CostMap& map, int start, int goal) {
  using Entry = std::pair<float, int>;  // cost so far, node
  std::vector<float> best(map.cost.size(), kForbidden);
  std::vector<int> from(map.cost.size(), -1);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  if (std::isfinite(map.cost[start])) open.push({best[start] = 0.0F, start});
  while (!open.empty() && open.top().second != goal) {
    const auto [so_far, node] = open.top();
    open.pop();
    if (so_far > best[node]) continue;
    for (int k = 0; k < 9; ++k) {  // forbidden cells frame the map: a passable node has all its neighbours
      const int dx = k % 3 - 1, dy = k / 3 - 1, next = node + dy * map.nodes.nx + dx;
      const auto length = static_cast<float>(map.nodes.step * std::hypot(dx, dy));
      const float reached = so_far + 0.5F * length * (map.cost[node] + map.cost[next]);
      if (!(reached < best[next])) continue;
      best[next] = reached;
      from[next] = node;
      open.push({reached, next});
    }
  }
  std::vector<int> path;
  if (!std::isfinite(best[goal])) return path;
  for (int node = goal; node >= 0; node = from[node]) path.push_back(node);
  std::reverse(path.begin(), path.end());
  return path;
}

Way places(const CostMap& map, const std::vector<int>& path) {
  Way way;
  for (const int node : path) way.push_back(map.place(node));
  return way;
}

/// Running mean of a way over its grid points, ends kept, thinned out.
Way smoothed(const Way& way, const Scale& scale) {
  const int count = static_cast<int>(way.size()), keep_every = static_cast<int>(scale.keep_m / scale.grid_m);
  const int smoothing = static_cast<int>(scale.half_smooth_m / scale.grid_m);
  Way result;
  for (int i = 0; i < count; i += keep_every) {
    const int half = std::min({smoothing, i, count - 1 - i});
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int k = i - half; k <= i + half; ++k) sum += way[k];
    result.push_back(sum / (2.0 * half + 1.0));
  }
  if ((result.back() - way.back()).norm() < 0.5 * scale.keep_m && result.size() > 1) result.pop_back();
  result.push_back(way.back());
  return result;
}

/// The far way: along the hills' gentle sides, past every waypoint.
Way far_way(const Terrain& terrain, const Way& waypoints) {
  const CostMap map = cost_map(terrain, kFar, waypoints);
  Way way;
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    Way leg = places(map, cheapest(map, map.node_of(waypoints[i]), map.node_of(waypoints[i + 1])));
    if (leg.empty()) unreachable(waypoints[i + 1]);
    way.insert(way.end(), leg.begin() + (way.empty() ? 0 : 1), leg.end());
  }
  return smoothed(way, kFar);
}

/// Goes along the far way around what it was too coarse to see: looks some distance ahead, drives a part of that.
Way near_way(const Terrain& terrain, const Way& far) {
  Way way{far.front()};
  for (std::size_t at = 0; at + 1 < far.size();) {
    const std::size_t goal = std::min(at + static_cast<std::size_t>(kLookAhead / kFar.keep_m), far.size() - 1);
    Way around(far.begin() + static_cast<std::ptrdiff_t>(at), far.begin() + static_cast<std::ptrdiff_t>(goal) + 1);
    around.push_back(way.back());
    CostMap map = cost_map(terrain, kNear, around);
    avoid_rocks(terrain.rocks(), map);
    prefer_tracks(way, map);
    const Way leg = places(map, cheapest(map, map.node_of(way.back()), map.node_of(far[goal])));
    if (leg.empty()) unreachable(far[goal]);
    at = goal + 1 == far.size() ? goal : std::min(at + static_cast<std::size_t>(kCommitted / kFar.keep_m), goal);
    const auto nearest = std::min_element(leg.begin() + 1, leg.end(), [&](const auto& a, const auto& b) {
      return (a - far[at]).squaredNorm() < (b - far[at]).squaredNorm();
    });
    way.insert(way.end(), leg.begin() + 1, nearest + 1);
  }
  return smoothed(way, kNear);
}

}  // namespace

std::vector<Eigen::Vector2d> plan(const Terrain& terrain, const std::vector<Eigen::Vector2d>& waypoints) {
  return near_way(terrain, far_way(terrain, waypoints));
}

RoverOptions with_known_route(const Terrain& terrain, RoverOptions rover) {
  if (rover.route == RouteKind::planned) {
    rover.waypoints_m = plan(terrain, rover.waypoints_m);
    rover.route = RouteKind::waypoints;
  } else if (rover.route == RouteKind::recorded) {
    rover.waypoints_m = recorded_places(rover.recording);
    rover.route = RouteKind::waypoints;
  }
  return rover;
}

}  // namespace demslam

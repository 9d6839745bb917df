#include "demslam/sim/planner.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr double kGrid = 5.0;      // metres
constexpr double kMargin = 300.0;  // the way may lead this far around the waypoints' bounding box
constexpr int kSmoothing = 6;      // half width of the running mean, grid steps
constexpr int kKeepEvery = 5;      // waypoints of the finished route, grid steps
constexpr float kForbidden = std::numeric_limits<float>::infinity();

/// Cost per metre at the nodes of a grid.
struct CostMap {
  Patch nodes;
  std::vector<float> cost;

  int node_of(const Eigen::Vector2d& p) const {
    const int ix = std::clamp(static_cast<int>(std::lround((p.x() - nodes.x0) / kGrid)), 0, nodes.nx - 1);
    const int iy = std::clamp(static_cast<int>(std::lround((p.y() - nodes.y0) / kGrid)), 0, nodes.ny - 1);
    return iy * nodes.nx + ix;
  }
  Eigen::Vector2d place(int node) const { return {nodes.x(node % nodes.nx), nodes.y(node / nodes.nx)}; }
};

float cost_of_slope(double slope_deg) {
  const double gentle = 1.0 + std::pow(slope_deg / 8.0, 2);
  return static_cast<float>(slope_deg > 18.0 ? 50.0 * gentle : gentle);
}

CostMap cost_map(const Terrain& terrain, const std::vector<Eigen::Vector2d>& waypoints) {
  Eigen::Vector2d low = waypoints.front(), high = waypoints.front();
  for (const Eigen::Vector2d& p : waypoints) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector2d size = (high - low).array() + 2.0 * kMargin;
  CostMap map{Patch(low.x() - kMargin, low.y() - kMargin, kGrid, static_cast<int>(size.x() / kGrid) + 1,
                    static_cast<int>(size.y() / kGrid) + 1),
              {}};
  terrain.fill(map.nodes);
  map.cost.assign(map.nodes.values.size(), kForbidden);
  for (int iy = 1; iy + 1 < map.nodes.ny; ++iy) {
    for (int ix = 1; ix + 1 < map.nodes.nx; ++ix) {
      const double x = map.nodes.x(ix), y = map.nodes.y(iy);
      if (!terrain.base().inside(x, y) || terrain.base().is_hole(x, y)) continue;
      const double dx = (map.nodes.at(ix + 1, iy) - map.nodes.at(ix - 1, iy)) / (2.0 * kGrid);
      const double dy = (map.nodes.at(ix, iy + 1) - map.nodes.at(ix, iy - 1)) / (2.0 * kGrid);
      map.cost[static_cast<std::size_t>(iy) * map.nodes.nx + ix] =
          cost_of_slope(std::atan(std::hypot(dx, dy)) * 180.0 / std::numbers::pi);
    }
  }
  return map;
}

[[noreturn]] void unreachable(const Eigen::Vector2d& goal) {
  char text[120];
  std::snprintf(text, sizeof text, "no way leads to the waypoint x = %.1f m, y = %.1f m; move it", goal.x(), goal.y());
  throw Error(text);
}

/// Nodes from `start` to `goal` by Dijkstra's method over the eight neighbours.
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
      const auto length = static_cast<float>(kGrid * std::hypot(dx, dy));
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

/// Running mean of a path, ends kept, thinned out.
std::vector<Eigen::Vector2d> smoothed(const std::vector<Eigen::Vector2d>& path) {
  const int count = static_cast<int>(path.size());
  std::vector<Eigen::Vector2d> result;
  for (int i = 0; i < count; i += kKeepEvery) {
    const int half = std::min({kSmoothing, i, count - 1 - i});
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int k = i - half; k <= i + half; ++k) sum += path[k];
    result.push_back(sum / (2.0 * half + 1.0));
  }
  if ((result.back() - path.back()).norm() < 0.5 * kKeepEvery * kGrid && result.size() > 1) result.pop_back();
  result.push_back(path.back());
  return result;
}

}  // namespace

std::vector<Eigen::Vector2d> plan(const Terrain& terrain, const std::vector<Eigen::Vector2d>& waypoints) {
  const CostMap map = cost_map(terrain, waypoints);
  std::vector<Eigen::Vector2d> way;
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    const std::vector<int> path = cheapest(map, map.node_of(waypoints[i]), map.node_of(waypoints[i + 1]));
    if (path.empty()) unreachable(waypoints[i + 1]);
    for (std::size_t k = way.empty() ? 0 : 1; k < path.size(); ++k) way.push_back(map.place(path[k]));
  }
  return smoothed(way);
}

RoverOptions with_planned_route(const Terrain& terrain, RoverOptions rover) {
  if (rover.route != RouteKind::planned) return rover;
  rover.waypoints_m = plan(terrain, rover.waypoints_m);
  rover.route = RouteKind::waypoints;
  return rover;
}

}  // namespace demslam

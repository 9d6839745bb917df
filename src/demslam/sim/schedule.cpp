#include "demslam/sim/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

/// A place on the route where the rover does not just drive on.
struct Halt {
  double s_m, pause_s;
  double from_heading = 0.0, turn = 0.0;  ///< of a point turn
};

std::vector<Halt> halts_of(const RoverOptions& rover, const Route& route) {
  std::vector<Halt> halts;
  for (const Route::Corner& corner : route.corners())
    halts.push_back({corner.s_m, 0.0, corner.from_heading, corner.turn});
  if (rover.stop_every_m > 0.0) {
    for (double s = rover.stop_every_m; s < route.length_m(); s += rover.stop_every_m) {
      halts.push_back({s, rover.stop_s, route.heading(s)});
    }
  }
  std::stable_sort(halts.begin(), halts.end(), [](const Halt& a, const Halt& b) { return a.s_m < b.s_m; });
  return halts;
}

constexpr double kStep_m = 0.25;  // of the route, over which a bend is measured

double speed_m_per_s(const RoverOptions& rover, const Route& route, double from_m, double to_m) {
  if (!route.corners().empty()) return rover.speed_m_per_s;  // straight legs
  const double turn = std::remainder(route.heading(to_m) - route.heading(from_m), 2.0 * std::numbers::pi);
  const double slowest_s = std::abs(turn) / (rover.max_turn_rate_deg_per_s * kRadPerDeg);
  return std::min(rover.speed_m_per_s, (to_m - from_m) / std::max(slowest_s, 1e-12));
}

}  // namespace

Schedule::Schedule(const RoverOptions& rover, const Route& route) : route_(route) {
  const double turn_rate = rover.turn_rate_deg_per_s * kRadPerDeg;
  phases_.push_back({0.0, 0.0, 0.0, 0.0, route.heading(0.0), 0.0});
  for (const Halt& halt : halts_of(rover, route)) {
    drive_to(halt.s_m, rover);
    stay(halt.pause_s + std::abs(halt.turn) / turn_rate, halt.from_heading, halt.turn);
  }
  drive_to(route.length_m(), rover);
}

/// One phase per stretch of the same speed.
void Schedule::drive_to(double s_m, const RoverOptions& rover) {
  for (double from = phases_.back().to_m; from < s_m;) {
    double to = std::min(from + kStep_m, s_m);
    const double speed = speed_m_per_s(rover, route_, from, to);
    while (to < s_m) {
      const double next = std::min(to + kStep_m, s_m);
      if (speed_m_per_s(rover, route_, to, next) != speed) break;
      to = next;
    }
    const double begin = phases_.back().end_s;
    phases_.push_back({begin, begin + (to - from) / speed, from, to, 0.0, 0.0});
    from = to;
  }
}

void Schedule::stay(double duration_s, double from_heading, double turn) {
  const double begin = phases_.back().end_s, s = phases_.back().to_m;
  if (duration_s > 0.0) phases_.push_back({begin, begin + duration_s, s, s, from_heading, turn});
}

Schedule::State Schedule::at(double time_s) const {
  const auto phase =
      std::partition_point(phases_.begin(), phases_.end() - 1, [&](const Phase& p) { return p.end_s <= time_s; });
  const double share = std::clamp((time_s - phase->begin_s) / std::max(phase->end_s - phase->begin_s, 1e-12), 0.0, 1.0);
  if (phase->to_m == phase->from_m) return {phase->to_m, phase->from_heading + share * phase->turn};
  const double s = phase->from_m + share * (phase->to_m - phase->from_m);
  return {s, route_.heading(s)};
}

}  // namespace demslam

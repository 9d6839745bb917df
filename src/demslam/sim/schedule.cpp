#include "demslam/sim/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace

Schedule::Schedule(const RoverOptions& rover, const Route& route) : route_(route) {
  const double turn_rate = rover.turn_rate_deg_per_s * std::numbers::pi / 180.0;
  phases_.push_back({0.0, 0.0, 0.0, 0.0, route.heading(0.0), 0.0});
  for (const Halt& halt : halts_of(rover, route)) {
    drive_to(halt.s_m, rover.speed_m_per_s);
    stay(halt.pause_s + std::abs(halt.turn) / turn_rate, halt.from_heading, halt.turn);
  }
  drive_to(route.length_m(), rover.speed_m_per_s);
}

void Schedule::drive_to(double s_m, double speed_m_per_s) {
  const double begin = phases_.back().end_s, from = phases_.back().to_m;
  if (s_m > from) phases_.push_back({begin, begin + (s_m - from) / speed_m_per_s, from, s_m, 0.0, 0.0});
}

void Schedule::stay(double duration_s, double from_heading, double turn) {
  const double begin = phases_.back().end_s, s = phases_.back().to_m;
  if (duration_s > 0.0) phases_.push_back({begin, begin + duration_s, s, s, from_heading, turn});
}

Schedule::State Schedule::at(double time_s) const {
  const auto phase = std::find_if(phases_.begin(), phases_.end() - 1, [&](const Phase& p) { return time_s < p.end_s; });
  const double share = std::clamp((time_s - phase->begin_s) / std::max(phase->end_s - phase->begin_s, 1e-12), 0.0, 1.0);
  if (phase->to_m == phase->from_m) return {phase->to_m, phase->from_heading + share * phase->turn};
  const double s = phase->from_m + share * (phase->to_m - phase->from_m);
  return {s, route_.heading(s)};
}

}  // namespace demslam

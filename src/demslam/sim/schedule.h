#pragma once

#include <vector>

#include "demslam/sim/route.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// When the rover is where on its route: drives at its speed, slower in tight bends, stands still where it was told to,
/// and turns on the spot at the corners of a route of legs.
class Schedule {
 public:
  Schedule(const RoverOptions& rover, const Route& route);

  struct State {
    double s_m;      ///< driven distance
    double heading;  ///< radians from East towards North
  };
  State at(double time_s) const;
  double duration_s() const { return phases_.back().end_s; }

 private:
  /// A time of steady motion: driving, or turning and standing at one place.
  struct Phase {
    double begin_s, end_s, from_m, to_m, from_heading, turn;
  };
  void drive_to(double s_m, const RoverOptions& rover);
  void stay(double duration_s, double from_heading, double turn);

  const Route& route_;
  std::vector<Phase> phases_;
};

}  // namespace demslam

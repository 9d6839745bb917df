#pragma once

#include <Eigen/Core>
#include <vector>

#include "demslam/sim/scene.h"

namespace demslam {

/// The driven line on the map: a curve with a continuous heading, by arc length in metres.
class Route {
 public:
  explicit Route(const RoverOptions& options);

  double length_m() const { return arc_m_.back(); }
  Eigen::Vector2d position(double s_m) const;
  double heading(double s_m) const;  ///< radians from East towards North
  /// Distance of a point from the line.
  double distance_m(const Eigen::Vector2d& point) const;
  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  std::size_t segment(double s_m) const;

  std::vector<Eigen::Vector2d> points_;  ///< dense polyline
  std::vector<double> arc_m_;            ///< arc length at each point
};

}  // namespace demslam

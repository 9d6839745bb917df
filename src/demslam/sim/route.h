#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "demslam/sim/scene.h"

namespace demslam {

/// The driven line on the map: a curve with a continuous heading, by arc length in metres. Questions about a place stay
/// cheap on a long route: its points are kept in runs with a bounding box each.
class Route {
 public:
  explicit Route(const RoverOptions& options);

  double length_m() const { return arc_m_.back(); }
  Eigen::Vector2d position(double s_m) const;
  double heading(double s_m) const;  ///< radians from East towards North
  /// Distance of a point from the line.
  double distance_m(const Eigen::Vector2d& point) const;
  const std::vector<Eigen::Vector2d>& points() const { return points_; }  ///< a dense polyline
  double arc_m(std::size_t point) const { return arc_m_[point]; }

  /// Where a route of legs turns on the spot.
  struct Corner {
    double s_m, from_heading, turn;  ///< radians, positive to the left
  };
  const std::vector<Corner>& corners() const { return corners_; }

  /// Segments points()[first .. last], in order, that may come into a rectangle: whole runs of them.
  struct Run {
    std::size_t first, last;
    Eigen::Vector2d low, high;  ///< bounding box
  };
  std::vector<Run> runs_in(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;

 private:
  std::size_t segment(double s_m) const;
  void cut(double length_m);
  void index();
  void find_corners();

  std::vector<Eigen::Vector2d> points_;
  std::vector<double> arc_m_;  ///< arc length at each point
  std::vector<Run> runs_;
  std::vector<Corner> corners_;
  double half_heading_m_;  ///< the heading is that of the chord this far back and ahead
};

}  // namespace demslam

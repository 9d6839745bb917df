#include "demslam/sim/route.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace demslam {
namespace {

constexpr double kSpacing = 0.1;  // metres between the points of the polyline
constexpr std::size_t kRunPoints = 64;
constexpr double kLoopOverlap = 1.03;  // a loop goes on over its first metres, so that they are seen again

Eigen::Vector2d direction(double angle) { return {std::cos(angle), std::sin(angle)}; }

std::vector<Eigen::Vector2d> straight(const RoverOptions& options) {
  const int count = std::max(1, static_cast<int>(std::ceil(options.length_m / kSpacing)));
  const Eigen::Vector2d along = direction(options.heading_deg * std::numbers::pi / 180.0);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= count; ++i) points.push_back(options.start_m + along * (options.length_m * i / count));
  return points;
}

/// A circle driven counter-clockwise, the centre to the left of the first pose.
std::vector<Eigen::Vector2d> loop(const RoverOptions& options) {
  const double heading = options.heading_deg * std::numbers::pi / 180.0;
  const double radius = options.length_m / (2.0 * std::numbers::pi);
  const Eigen::Vector2d centre = options.start_m + radius * direction(heading + 0.5 * std::numbers::pi);
  const int count = std::max(16, static_cast<int>(std::ceil(options.length_m * kLoopOverlap / kSpacing)));
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= count; ++i) {
    const double angle = heading - 0.5 * std::numbers::pi + 2.0 * std::numbers::pi * kLoopOverlap * i / count;
    points.push_back(centre + radius * direction(angle));
  }
  return points;
}

/// Cubic Hermite between two waypoints with the given end tangents.
Eigen::Vector2d hermite(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& ta,
                        const Eigen::Vector2d& tb, double t) {
  const double t2 = t * t, t3 = t2 * t;
  return (2.0 * t3 - 3.0 * t2 + 1.0) * a + (t3 - 2.0 * t2 + t) * ta + (3.0 * t2 - 2.0 * t3) * b + (t3 - t2) * tb;
}

/// Unit direction of the curve at waypoint i: towards the next one at the ends, the bisector inside.
Eigen::Vector2d tangent(const std::vector<Eigen::Vector2d>& way, std::size_t i) {
  const Eigen::Vector2d before = i > 0 ? (way[i] - way[i - 1]).normalized() : (way[1] - way[0]).normalized();
  const Eigen::Vector2d after = i + 1 < way.size() ? (way[i + 1] - way[i]).normalized() : before;
  const Eigen::Vector2d sum = before + after;
  return sum.norm() > 1e-6 ? Eigen::Vector2d(sum.normalized()) : before;
}

std::vector<Eigen::Vector2d> through(const std::vector<Eigen::Vector2d>& way) {
  std::vector<Eigen::Vector2d> points{way.front()};
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const double chord = (way[i + 1] - way[i]).norm();
    const int count = std::max(1, static_cast<int>(std::ceil(chord / kSpacing)));
    const Eigen::Vector2d ta = chord * tangent(way, i), tb = chord * tangent(way, i + 1);
    for (int k = 1; k <= count; ++k)
      points.push_back(hermite(way[i], way[i + 1], ta, tb, static_cast<double>(k) / count));
  }
  return points;
}

/// Straight legs from waypoint to waypoint.
std::vector<Eigen::Vector2d> legs(const std::vector<Eigen::Vector2d>& way) {
  std::vector<Eigen::Vector2d> points{way.front()};
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const int count = std::max(1, static_cast<int>(std::ceil((way[i + 1] - way[i]).norm() / kSpacing)));
    for (int k = 1; k <= count; ++k)
      points.push_back(way[i] + (way[i + 1] - way[i]) * (static_cast<double>(k) / count));
  }
  return points;
}

std::vector<Eigen::Vector2d> points_of(const RoverOptions& options) {
  if (options.route == RouteKind::loop) return loop(options);
  if (options.route == RouteKind::legs) return legs(options.waypoints_m);
  return options.route == RouteKind::waypoints ? through(options.waypoints_m) : straight(options);
}

}  // namespace

Route::Route(const RoverOptions& options)
    : points_(points_of(options)),
      arc_m_{0.0},
      half_heading_m_(options.route == RouteKind::legs ? 1e-3 * kSpacing : 2.0 * kSpacing) {
  for (std::size_t i = 1; i < points_.size(); ++i) {
    arc_m_.push_back(arc_m_.back() + (points_[i] - points_[i - 1]).norm());
  }
  if (options.stop_after_m > 0.0 && options.stop_after_m < length_m()) cut(options.stop_after_m);
  index();
  if (options.route == RouteKind::legs) find_corners();
}

void Route::find_corners() {
  constexpr double kStraight = 1e-6;  // radians
  for (std::size_t i = 1; i + 1 < points_.size(); ++i) {
    const Eigen::Vector2d before = points_[i] - points_[i - 1], after = points_[i + 1] - points_[i];
    const double turn = std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
    if (std::abs(turn) > kStraight) corners_.push_back({arc_m_[i], std::atan2(before.y(), before.x()), turn});
  }
}

void Route::cut(double length_m) {
  const Eigen::Vector2d end = position(length_m);
  const std::size_t kept = segment(length_m) + 1;
  points_.resize(kept);
  arc_m_.resize(kept);
  points_.push_back(end);
  arc_m_.push_back(length_m);
}

void Route::index() {
  for (std::size_t first = 0; first + 1 < points_.size(); first += kRunPoints) {
    Run run{first, std::min(first + kRunPoints, points_.size() - 1), points_[first], points_[first]};
    for (std::size_t i = first; i <= run.last; ++i) {
      run.low = run.low.cwiseMin(points_[i]);
      run.high = run.high.cwiseMax(points_[i]);
    }
    runs_.push_back(run);
  }
}

std::vector<Route::Run> Route::runs_in(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  std::vector<Run> found;
  for (const Run& run : runs_) {
    if ((run.low.array() <= high.array()).all() && (run.high.array() >= low.array()).all()) found.push_back(run);
  }
  return found;
}

std::size_t Route::segment(double s_m) const {
  const auto next = std::upper_bound(arc_m_.begin(), arc_m_.end(), s_m);
  const auto index = std::distance(arc_m_.begin(), next) - 1;
  return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(index, 0, std::ssize(points_) - 2));
}

Eigen::Vector2d Route::position(double s_m) const {
  const std::size_t i = segment(s_m);
  const double span = std::max(arc_m_[i + 1] - arc_m_[i], 1e-12);
  return points_[i] + (s_m - arc_m_[i]) / span * (points_[i + 1] - points_[i]);
}

double Route::heading(double s_m) const {
  const double back = std::max(0.0, s_m - half_heading_m_), ahead = std::min(length_m(), s_m + half_heading_m_);
  const Eigen::Vector2d along = position(ahead) - position(back);
  return std::atan2(along.y(), along.x());
}

double Route::distance_m(const Eigen::Vector2d& point) const {
  double best = std::numeric_limits<double>::infinity();
  for (const Run& run : runs_) {
    if ((point.cwiseMax(run.low).cwiseMin(run.high) - point).squaredNorm() >= best) continue;
    for (std::size_t i = run.first; i < run.last; ++i) {
      const Eigen::Vector2d along = points_[i + 1] - points_[i];
      const double t = std::clamp((point - points_[i]).dot(along) / std::max(along.squaredNorm(), 1e-18), 0.0, 1.0);
      best = std::min(best, (point - points_[i] - t * along).squaredNorm());
    }
  }
  return std::sqrt(best);
}

}  // namespace demslam

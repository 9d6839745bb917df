#include "demslam/report/map_picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr Colour kInk{20, 20, 24}, kPaper{255, 255, 255}, kNoData{70, 72, 80};

using Box = Eigen::AlignedBox2d;

/// Map metres to picture pixels, North up.
class View {
 public:
  View(const Box& ground, int width) : ground_(ground), metres_per_px_(ground.sizes().x() / width) {}
  int height_px() const { return static_cast<int>(std::lround(ground_.sizes().y() / metres_per_px_)); }
  double metres_per_px() const { return metres_per_px_; }
  Eigen::Vector2d pixel(const Eigen::Vector2d& p_map) const {
    return {(p_map.x() - ground_.min().x()) / metres_per_px_ - 0.5,
            (ground_.max().y() - p_map.y()) / metres_per_px_ - 0.5};
  }
  Eigen::Vector2d map(int u, int v) const {
    return {ground_.min().x() + (u + 0.5) * metres_per_px_, ground_.max().y() - (v + 0.5) * metres_per_px_};
  }

 private:
  Box ground_;
  double metres_per_px_;
};

/// The tracks' bounding box with a margin, not flatter than 2:5 either way.
Box ground_of(const std::vector<MapTrack>& tracks, double margin) {
  Box box;
  for (const MapTrack& track : tracks) {
    for (const StampedPose& stamped : track.trajectory) box.extend(stamped.pose.translation().head<2>());
  }
  if (box.isEmpty()) throw Error("map picture: there is no pose to draw");
  const double longest = std::max(box.sizes().maxCoeff(), 10.0);
  Eigen::Vector2d size = box.sizes() + Eigen::Vector2d::Constant(2.0 * margin * longest);
  size = size.cwiseMax(0.4 * size.maxCoeff());
  return Box(box.center() - 0.5 * size, box.center() + 0.5 * size);
}

/// Lambert shading of the terrain, 0 to 255 with mid grey for level ground.
std::vector<float> shade(const Dem& dem, const View& view, int width, int height, const MapPictureOptions& options) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double azimuth = options.sun_azimuth_deg * kDegree, elevation = options.sun_elevation_deg * kDegree;
  const Eigen::Vector3d sun(std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation),
                            std::sin(elevation));
  std::vector<float> grey(static_cast<std::size_t>(width) * height, std::numeric_limits<float>::quiet_NaN());
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d p = view.map(u, v);
      const auto sample = dem.sample(p.x(), p.y());
      if (!sample) continue;
      const Eigen::Vector3d normal = Eigen::Vector3d(-sample->gradient.x(), -sample->gradient.y(), 1.0).normalized();
      grey[static_cast<std::size_t>(v) * width + u] = static_cast<float>(255.0 * std::max(0.0, normal.dot(sun)));
    }
  }
  return grey;
}

/// The largest of 1, 2, 5 x 10^n metres that is at most a quarter of the picture.
double scale_bar_m(double width_m) {
  const double limit = 0.25 * width_m, power = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= limit) return step * power;
  }
  return power;
}

void draw_scale_bar(Canvas& canvas, const View& view) {
  const double length_m = scale_bar_m(canvas.width() * view.metres_per_px());
  const double length_px = length_m / view.metres_per_px(), y = canvas.height() - 24.0;
  canvas.line({24.0, y}, {24.0 + length_px, y}, kPaper, 7);
  canvas.line({24.0, y}, {24.0 + length_px, y}, kInk, 3);
  const std::string label = fmt::format("{:g} m   (north up)", length_m);
  canvas.text(label, {24.0, y - 12.0}, kPaper, 0.7, 4);
  canvas.text(label, {24.0, y - 12.0}, kInk, 0.7, 1);
}

void draw_track(Canvas& canvas, const View& view, const MapTrack& track) {
  std::vector<Eigen::Vector2d> points;
  for (const StampedPose& stamped : track.trajectory)
    points.push_back(view.pixel(stamped.pose.translation().head<2>()));
  if (points.empty()) return;
  canvas.polyline(points, kInk, 5);
  canvas.polyline(points, track.colour, 3);
  canvas.circle(points.front(), 6.0, kPaper, -1);
  canvas.circle(points.back(), 6.0, track.colour, -1);
}

void draw_legend(Canvas& canvas, const std::vector<MapTrack>& tracks, const std::string& title) {
  double y = 34.0;
  const auto line = [&](const std::string& text, double x) {
    canvas.text(text, {x, y}, kPaper, 0.8, 5);
    canvas.text(text, {x, y}, kInk, 0.8, 1);
  };
  if (!title.empty()) line(title, 24.0);
  for (const MapTrack& track : tracks) {
    y += title.empty() && &track == &tracks.front() ? 0.0 : 30.0;
    canvas.line({24.0, y - 7.0}, {60.0, y - 7.0}, kInk, 7);
    canvas.line({24.0, y - 7.0}, {60.0, y - 7.0}, track.colour, 4);
    line(track.label, 72.0);
  }
}

}  // namespace

Canvas draw_map_picture(const Dem& dem, const std::vector<MapTrack>& tracks, const MapPictureOptions& options) {
  const View view(ground_of(tracks, options.margin), options.width);
  Canvas canvas(options.width, view.height_px(), kNoData);
  const std::vector<float> grey = shade(dem, view, canvas.width(), canvas.height(), options);
  canvas.draw(grey, canvas.width(), 0.0F, 255.0F);
  for (const MapTrack& track : tracks) draw_track(canvas, view, track);
  draw_legend(canvas, tracks, options.title);
  draw_scale_bar(canvas, view);
  return canvas;
}

}  // namespace demslam

#include "demslam/sim/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "demslam/dem/hillshade.h"
#include "demslam/image/canvas.h"
#include "demslam/image/encoded.h"
#include "demslam/image/gif.h"
#include "demslam/sim/mission.h"

namespace demslam {
namespace {

constexpr int kColumns = 4, kRows = 3, kTile = 240, kGap = 4, kTitle = 26;
constexpr int kPlan = kRows * (kTile + kGap) - kGap;  // pixels of the plan view's side
constexpr Colour kPaper{24, 24, 24}, kInk{235, 235, 235}, kTrack{255, 150, 40}, kStart{80, 220, 120};

Image shrunk(const Image& image, int width) {
  const int box = std::max(1, image.width / width);
  Image small(image.width / box, image.height / box);
  for (int v = 0; v < small.height; ++v) {
    for (int u = 0; u < small.width; ++u) {
      int sum = 0;
      for (int k = 0; k < box * box; ++k) sum += image.at(u * box + k % box, v * box + k / box);
      small.at(u, v) = static_cast<std::uint8_t>(sum / (box * box));
    }
  }
  return small;
}

/// A square of ground around the trajectory, one cell per pixel of the plan view.
DemRaster ground_around(const Mission& mission) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const StampedPose& stamped : mission.trajectory()) {
    low = low.cwiseMin(stamped.pose.translation().head<2>());
    high = high.cwiseMax(stamped.pose.translation().head<2>());
  }
  DemRaster raster;
  raster.rows = raster.cols = kPlan;
  raster.cell_m = std::max(20.0, 1.15 * (high - low).maxCoeff()) / kPlan;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * kPlan * raster.cell_m), middle = 0.5 * (low + high);
  raster.west_m = middle.x() - half.x();
  raster.north_m = middle.y() + half.y();
  Patch patch(raster.centre(0, 0).x(), raster.centre(kPlan - 1, 0).y(), raster.cell_m, kPlan, kPlan);
  mission.terrain().fill_ground(patch);
  for (int row = 0; row < kPlan; ++row) {
    for (int col = 0; col < kPlan; ++col) raster.heights.push_back(static_cast<float>(patch.at(col, kPlan - 1 - row)));
  }
  return raster;
}

void draw_plan(Canvas& canvas, const Mission& mission, int u, int v) {
  const DemRaster ground = ground_around(mission);
  const LightOptions& light = mission.scene().light;
  const std::vector<float> shade =
      hillshade(ground, {90.0 - light.sun_azimuth_deg, std::max(light.sun_elevation_deg, 15.0), 1.0});
  canvas.draw(shade, kPlan, 0.0F, 1.0F, u, v);
  std::vector<Eigen::Vector2d> line;
  for (const StampedPose& stamped : mission.trajectory()) {
    const Eigen::Vector3d& p = stamped.pose.translation();
    line.emplace_back(u + (p.x() - ground.west_m) / ground.cell_m, v + (ground.north_m - p.y()) / ground.cell_m);
  }
  canvas.polyline(line, kTrack, 2);
  canvas.circle(line.front(), 5.0, kStart, -1);
  const double bar_m = std::pow(10.0, std::floor(std::log10(0.4 * kPlan * ground.cell_m)));
  const Eigen::Vector2d bar(u + 14.0, v + kPlan - 14.0);
  canvas.line(bar, bar + Eigen::Vector2d(bar_m / ground.cell_m, 0.0), kTrack, 3);
  char text[40];
  std::snprintf(text, sizeof text, "%g m", bar_m);
  canvas.text(text, bar - Eigen::Vector2d(0.0, 8.0), kTrack, 0.6);
}

std::string title_of(const Mission& mission) {
  const LightOptions& light = mission.scene().light;
  char text[160];
  std::snprintf(text, sizeof text, "%.0f m, %zu frames, sun %.1f deg high from %.0f deg (East to North)",
                path_length_m(mission.trajectory()), mission.trajectory().size(), light.sun_elevation_deg,
                light.sun_azimuth_deg);
  return text;
}

}  // namespace

Image MissionPictures::shrunk_frame(std::size_t index, int width) {
  const TimestampNs t_ns = mission_.trajectory()[index].t_ns;
  const std::filesystem::path file = dataset_ / "image0/color" / (std::to_string(t_ns) + ".png");
  return shrunk(std::filesystem::exists(file) ? read_image(file) : mission_.frame(index).left, width);
}

void MissionPictures::write_contact_sheet(const std::filesystem::path& file) {
  const int width = kColumns * (kTile + kGap);
  Canvas canvas(width + kPlan, kTitle + kPlan, kPaper);
  canvas.text(title_of(mission_), {6.0, kTitle - 8.0}, kInk, 0.6);
  const std::size_t last = mission_.trajectory().size() - 1;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Image tile = shrunk_frame(last * static_cast<std::size_t>(i) / (kColumns * kRows - 1), kTile);
    canvas.draw(tile, (i % kColumns) * (kTile + kGap), kTitle + (i / kColumns) * (kTile + kGap),
                static_cast<double>(kTile) / tile.width);
  }
  draw_plan(canvas, mission_, width, kTitle);
  canvas.write(file);
}

void MissionPictures::write_video(const std::filesystem::path& file) {
  constexpr std::size_t kFrames = 100;
  constexpr double kSeconds = 10.0;
  const std::size_t count = std::min(kFrames, mission_.trajectory().size());
  std::vector<Image> frames;
  for (std::size_t i = 0; i < count; ++i) {
    frames.push_back(shrunk_frame((mission_.trajectory().size() - 1) * i / std::max<std::size_t>(count - 1, 1), 256));
  }
  write_encoded(file, gif_bytes(frames, kSeconds / static_cast<double>(count)));
}

}  // namespace demslam

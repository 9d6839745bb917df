#include "demslam/anchoring/terrain_patch.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace demslam {
namespace {

constexpr double kFinest_m = 1.0;  // as the rover's own footprint

/// A landmark over the terrain.
struct Sounding {
  Eigen::Vector3d p_map;
  double height_m = 0.0;  ///< above the DEM
  double variance_m2 = 0.0;
};

using Cells = std::map<std::pair<int, int>, std::vector<Sounding>>;

std::optional<Sounding> sound(const PosedLandmarks& view, const LandmarkPoint& landmark, const Dem* dem) {
  const Eigen::Vector3d p_map = view.T_map_left * landmark.p_left;
  const auto terrain = dem != nullptr ? dem->sample(p_map.x(), p_map.y()) : std::optional(DemSample{});
  if (!terrain) return std::nullopt;
  const Eigen::Vector3d across(-terrain->gradient.x(), -terrain->gradient.y(),
                               1.0);  // height error of a position error
  const Eigen::Vector3d across_left = view.T_map_left.rotation().conjugate() * across;
  return Sounding{p_map, p_map.z() - terrain->height_m, across_left.dot(landmark.covariance * across_left)};
}

/// The grid of a patch is turned against the DEM's. Were they aligned, all means would lie near cell centres, where
/// interpolation smooths the DEM's noise least, and the residuals of a whole patch would shrink together when it slides
/// half a cell aside: a pull of more than a metre, with full confidence.
std::pair<int, int> cell_of(const Eigen::Vector3d& p_map, double cell_m) {
  constexpr double kCosine = 0.8775825618903728, kSine = 0.479425538604203;  // 0.5 rad
  const double u = kCosine * p_map.x() + kSine * p_map.y(), v = kCosine * p_map.y() - kSine * p_map.x();
  return {static_cast<int>(std::floor(u / cell_m)), static_cast<int>(std::floor(v / cell_m))};
}

Cells sort_into_cells(const std::vector<PosedLandmarks>& stretch, const Dem* dem, double cell_m) {
  Cells cells;
  for (const PosedLandmarks& view : stretch) {
    for (const LandmarkPoint& landmark : *view.points) {
      const auto sounding = sound(view, landmark, dem);
      if (sounding) cells[cell_of(sounding->p_map, cell_m)].push_back(*sounding);
    }
  }
  return cells;
}

double median_height(std::vector<Sounding> soundings) {
  const auto middle = soundings.begin() + std::ssize(soundings) / 2;
  std::nth_element(soundings.begin(), middle, soundings.end(),
                   [](const Sounding& a, const Sounding& b) { return a.height_m < b.height_m; });
  return middle->height_m;
}

/// Inverse-variance mean of the points that agree with their median; nothing when too few do.
std::optional<PatchCell> average(const std::vector<Sounding>& soundings, const Pose& T_body_map,
                                 const PatchOptions& options) {
  const double median_m = median_height(soundings);
  const double relief = options.sigma_relief_m * options.sigma_relief_m;
  PatchCell cell;
  double information = 0.0;
  for (const Sounding& s : soundings) {
    if (std::abs(s.height_m - median_m) > options.gate_m + options.gate_sigmas * std::sqrt(s.variance_m2)) continue;
    const double weight = 1.0 / (s.variance_m2 + relief);
    cell.p_body += weight * s.p_map;
    information += weight;
    ++cell.points;
  }
  if (cell.points < options.min_points) return std::nullopt;
  cell.p_body = T_body_map * Eigen::Vector3d(cell.p_body / information);
  cell.variance_m2 = 1.0 / information + relief;
  return cell;
}

std::optional<TerrainPatch> patch_over(const Dem* dem, const std::vector<PosedLandmarks>& stretch, std::size_t keyframe,
                                       const Pose& T_map_body, const PatchOptions& options) {
  TerrainPatch patch{.keyframe = keyframe};
  const Pose T_body_map = T_map_body.inverse();
  for (const auto& [index, soundings] : sort_into_cells(stretch, dem, options.cell_m)) {
    const auto cell = average(soundings, T_body_map, options);
    if (cell) patch.cells.push_back(*cell);
  }
  if (std::ssize(patch.cells) < options.min_cells) return std::nullopt;
  return patch;
}

}  // namespace

double relief_within(double cell_m, double in_5m_m) {
  constexpr double kHurst = 0.76;
  return in_5m_m * std::pow(std::max(kFinest_m, cell_m) / 5.0, kHurst);
}

PatchOptions fitted_to(double dem_cell_m, PatchOptions options) {
  options.cell_m = std::min(options.cell_m, std::max(kFinest_m, dem_cell_m));
  options.sigma_relief_m = relief_within(dem_cell_m, options.sigma_relief_m);
  return options;
}

std::optional<TerrainPatch> build_patch(const std::vector<PosedLandmarks>& stretch, std::size_t keyframe,
                                        const Pose& T_map_body, const Dem& dem, const PatchOptions& options) {
  return patch_over(&dem, stretch, keyframe, T_map_body, options);
}

std::optional<TerrainPatch> build_patch(const std::vector<PosedLandmarks>& stretch, std::size_t keyframe,
                                        const Pose& T_map_body, const PatchOptions& options) {
  return patch_over(nullptr, stretch, keyframe, T_map_body, options);
}

}  // namespace demslam

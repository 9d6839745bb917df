#pragma once

#include <optional>
#include <vector>

#include "demslam/anchoring/patch_factor_options.h"
#include "demslam/anchoring/terrain_patch.h"

namespace demslam {

/// Where a search looks: a square around a position, and headings on both sides of one.
struct SearchWindow {
  double radius_m = 30.0;  ///< half the square's side
  double step_m = 2.5;
  double heading_rad = 0.05;  ///< both ways; pi: all of them
};

/// A pose of the submap's keyframe with how badly the submap fits there.
struct TerrainMatch {
  Pose T_map_body;
  double chi_square = 0.0;
  bool at_edge = false;                     ///< on the border of the searched window
  Matrix6d information = Matrix6d::Zero();  ///< of the right perturbation, from the curvature; only when refined
};

/// Ground to be found again on a DEM, in x, y, heading and height. The chi-square of a pose is that of its residuals
/// z - h(x, y), softened and whitened as in a TerrainPatchFactor; height is free, tilt is known to `sigma_tilt_rad`,
/// both taken at their best for every pose (marginalised).
class TerrainSearch {
 public:
  /// `T_map_body`: where the keyframe is believed to be; its tilt is what the search keeps to.
  TerrainSearch(const TerrainPatch& submap, const Pose& T_map_body, std::shared_ptr<const Dem> dem,
                const DemErrorModel& dem_error, const PatchFactorOptions& options, double sigma_tilt_rad);

  /// For every grid position with all its ground on the DEM, the best heading. Row by row, south to north.
  std::vector<TerrainMatch> scan(const SearchWindow& window) const;
  /// The nearest minimum, with its curvature. Nothing when the ground leaves the DEM on the way.
  std::optional<TerrainMatch> refined(const TerrainMatch& start) const;
  std::size_t cells() const { return submap_.cells.size(); }

 private:
  Eigen::MatrixXf heights_above(const Eigen::Matrix2Xd& cells, const Eigen::Vector2d& first, double step_m, int count,
                                std::vector<bool>& covered) const;
  Eigen::VectorXf chi_squares(const Eigen::MatrixXf& above) const;

  TerrainPatch submap_;
  Pose T_map_body_;
  std::shared_ptr<const Dem> dem_;
  DemErrorModel dem_error_;
  PatchFactorOptions options_;
  double sigma_tilt_rad_;
  Eigen::Matrix2Xd cells_m_;   ///< horizontal, from the keyframe, map axes
  Eigen::VectorXf heights_m_;  ///< map z
  Eigen::VectorXf soft_m_;
  Eigen::MatrixXf levelling_;  ///< takes the plane out, as far as height and tilt are free
  Eigen::MatrixXf whitening_;  ///< of softened residuals; height and tilt projected out
};

}  // namespace demslam

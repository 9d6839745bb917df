#pragma once

#include <optional>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/dem/error_model.h"
#include "demslam/geometry/pose.h"

namespace demslam {

/// A triangulated point of the ground and the covariance of its stereo measurement, in the left camera's frame.
struct LandmarkPoint {
  Eigen::Vector3d p_left = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// The ground points one keyframe saw.
struct KeyframeLandmarks {
  std::size_t keyframe = 0;
  std::vector<LandmarkPoint> points;
};

/// One cell of local ground: the mean of the points seen in it, in the body frame of the patch's keyframe.
struct PatchCell {
  Eigen::Vector3d p_body = Eigen::Vector3d::Zero();
  double variance_m2 = 0.0;  ///< of its height against the terrain at its own position
  int points = 0;
};

/// Ground seen along a stretch of path, rigidly tied to the keyframe in its middle.
struct TerrainPatch {
  std::size_t keyframe = 0;
  std::vector<PatchCell> cells;
};

struct PatchOptions {
  double length_m = 20.0;  ///< of path per patch
  double cell_m = 5.0;     ///< on a finer DEM as fine as that, but no finer than a metre (fitted_to)
  int min_points = 4;      ///< per cell
  double gate_m = 0.5;  ///< a point stays within gate_m + gate_sigmas * sigma of its cell's median: rocks, mismatches
  double gate_sigmas = 3.0;
  double sigma_relief_m = 0.15;  ///< ground within a DEM's cell of 5 m against the cell's height
  int min_cells = 5;             ///< a smaller patch is not worth a factor
};

/// Ground within a cell against the cell's height, from what it is in cells of 5 m. Relief is self-affine; the exponent
/// is the maria's (0.76; highlands 0.95: Rosenburg et al., Global surface slopes and roughness of the Moon, JGR 116,
/// 2011).
double relief_within(double cell_m, double in_5m_m);

/// The options for a DEM of such cells.
PatchOptions fitted_to(double dem_cell_m, PatchOptions options);

/// A keyframe's landmarks with its pose at the present estimate.
struct PosedLandmarks {
  Pose T_map_left;
  const std::vector<LandmarkPoint>* points = nullptr;
};

/// Averages the landmarks of a stretch into cells of ground. Outliers are judged against the median of their own cell,
/// heights taken above the DEM so that slopes inside a cell do not count as scatter; the result does not depend on the
/// DEM otherwise. Nothing where the DEM has no value or too few cells remain.
std::optional<TerrainPatch> build_patch(const std::vector<PosedLandmarks>& stretch, std::size_t keyframe,
                                        const Pose& T_map_body, const Dem& dem, const PatchOptions& options);
/// The same without a DEM, before the rover knows where it is: heights are judged as they are, so the gate should leave
/// room for the slope inside a cell.
std::optional<TerrainPatch> build_patch(const std::vector<PosedLandmarks>& stretch, std::size_t keyframe,
                                        const Pose& T_map_body, const PatchOptions& options);

}  // namespace demslam

#pragma once

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <memory>

#include "demslam/anchoring/patch_factor_options.h"
#include "demslam/anchoring/terrain_gradient.h"
#include "demslam/anchoring/terrain_patch.h"

namespace demslam {

/// Covariance of the cells' residuals on a DEM: the DEM's error between them, and each cell's own.
Eigen::MatrixXd cell_covariance(const std::vector<PatchCell>& cells, const DemErrorModel& dem_error);

/// How much better (chi-square) the DEM's relief explains the patch than the plane through it does, heights free in
/// both. Negative where the DEM's relief is its error: there its slopes say nothing about the place.
double relief_evidence(const TerrainPatch& patch, const Pose& T_map_body, const Dem& dem,
                       const DemErrorModel& dem_error);

/// A patch of seen ground lies on the DEM: per cell z - h(x, y) with the full gradient, whitened by the covariance of
/// the DEM's error between the cells plus each cell's own variance. A single cell that disagrees is softened (asinh)
/// before the whitening, so that it cannot pull its neighbours. A cell outside the DEM contributes nothing; the factor
/// is inactive when half of them are.
class TerrainPatchFactor : public gtsam::NoiseModelFactor1<gtsam::Pose3> {
 public:
  TerrainPatchFactor(const TerrainPatch& patch, std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error,
                     const PatchFactorOptions& options, TerrainGradient gradient = TerrainGradient::full);
  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body,
                              boost::optional<gtsam::Matrix&> H = boost::none) const override;
  bool active(const gtsam::Values& values) const override;
  gtsam::NonlinearFactor::shared_ptr clone() const override;

 private:
  std::vector<PatchCell> cells_;
  std::shared_ptr<const Dem> dem_;
  TerrainGradient gradient_;
  Eigen::VectorXd soft_m_;                   ///< per cell
  Eigen::MatrixXd square_root_information_;  ///< W with W^T W = scale * covariance^-1, lower triangular
};

}  // namespace demslam

#include "demslam/anchoring/explained_relief.h"

#include <Eigen/LU>

#include "demslam/anchoring/patch_factor.h"

namespace demslam {

double explained_relief(const TerrainPatch& submap, const Pose& T_map_body, const Dem& dem,
                        const DemErrorModel& dem_error) {
  const Eigen::Index n = std::ssize(submap.cells);
  Eigen::MatrixX3d plane(n, 3);
  Eigen::VectorXd heights(n), above(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p = T_map_body * submap.cells[i].p_body;
    const auto ground = dem.height(p.x(), p.y());
    if (!ground) return 0.0;
    plane.row(i) << 1.0, (p - T_map_body.translation()).head<2>().transpose();
    heights[i] = p.z();
    above[i] = p.z() - *ground;
  }
  const Eigen::MatrixXd information = cell_covariance(submap.cells, dem_error).inverse();
  const Eigen::MatrixX3d weighted = information * plane;
  const Eigen::Matrix3d normal = (plane.transpose() * weighted).inverse();
  const auto chi_square = [&](const Eigen::VectorXd& r) {
    const Eigen::Vector3d along = weighted.transpose() * r;
    return r.dot(information * r) - along.dot(normal * along);
  };
  return 1.0 - chi_square(above) / chi_square(heights);
}

}  // namespace demslam

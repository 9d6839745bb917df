#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/report/internal/distance_axis.h"
#include "demslam/report/internal/run_map.h"

namespace demslam {

/// {"odometry": columns, "loop": columns}: the factors of map.db against the final poses; without a map the odometry
/// alone, as odometry.tum against trajectory.tum between neighbouring keyframes.
nlohmann::ordered_json residuals_json(const ReportRun& run, const std::vector<KeyframePose>& keyframes,
                                      const DistanceAxis& distance, const MapStore* map);

/// By kind, from residuals.csv: {"dem_height": {"distance_m", "sigmas"}, ...}, where "sigmas" is the root of the mean
/// squared whitened row. Empty where the run wrote none.
nlohmann::ordered_json factor_residuals_json(const ReportRun& run, const std::vector<KeyframePose>& keyframes,
                                             const DistanceAxis& distance, std::size_t max_rows);

/// Height and normal residual of every keyframe, whether the run tied it to the DEM or not.
Columns terrain_residuals(const std::vector<KeyframePose>& keyframes, const DistanceAxis& distance, const Dem& dem,
                          const Eigen::Vector3d& p_body_ground);

}  // namespace demslam

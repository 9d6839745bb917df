#pragma once

#include <memory>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/geometry/pose.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

/// How a graph's keyframes are tied to the DEM.
struct AnchoringOptions {
  double spacing_m = 5.0;         ///< path between two anchored keyframes
  double sigma_dem_m = 0.5;       ///< the DEM's vertical error
  double sigma_contact_m = 0.15;  ///< ground inside a cell against the cell's height, added in quadrature
  bool normal = true;             ///< the normal factor too
  double sigma_normal_deg = 4.0;  ///< the DEM's slope error and wheelbase against cell
  double kernel_sigmas = 2.5;     ///< Cauchy
  bool full_gradient = true;      ///< false: the published height factor, whose Jacobian has only its vertical part
  double max_tilt_deg = 60.0;     ///< a keyframe estimated steeper than this gets no normal factor
};

/// What became of the keyframes that were due.
struct AnchoringReport {
  int height = 0, normal = 0;
  int skipped_outside = 0;  ///< outside the DEM or at a hole, at the estimate of that moment
  int skipped_tilt = 0;     ///< height factor only
};

/// Adds DEM factors to keyframes as they come, one every `spacing_m` of path. The DEM lies in the graph's map frame.
class DemAnchor {
 public:
  DemAnchor(std::shared_ptr<const Dem> dem, const AnchoringOptions& options, const Eigen::Vector3d& p_body_ground);

  /// Looks at every keyframe of the graph that it has not seen yet, at its present estimate.
  void update(PoseGraph& graph);
  const AnchoringReport& report() const { return report_; }

 private:
  void anchor(PoseGraph& graph, std::size_t keyframe);

  std::shared_ptr<const Dem> dem_;
  AnchoringOptions options_;
  Eigen::Vector3d p_body_ground_;
  AnchoringReport report_;
  std::size_t seen_ = 0;
  double path_since_anchor_m_ = 0.0;
};

/// All keyframes of a graph at once.
AnchoringReport add_dem_factors(PoseGraph& graph, std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                                const Eigen::Vector3d& p_body_ground);

}  // namespace demslam

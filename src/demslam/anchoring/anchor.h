#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/anchoring/believed_terrain.h"
#include "demslam/anchoring/patch_factor_options.h"
#include "demslam/anchoring/start_search.h"
#include "demslam/anchoring/submap_recovery.h"
#include "demslam/anchoring/terrain_gradient.h"
#include "demslam/anchoring/terrain_patch.h"
#include "demslam/dem/dem.h"
#include "demslam/geometry/pose.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {

/// How a graph's keyframes are tied to the DEM.
struct AnchoringOptions {
  bool height = true;               ///< the height factor on the ground contact point
  double spacing_m = 5.0;           ///< path between two keyframes with height and normal factors
  double sigma_dem_m = 0.5;         ///< the DEM's vertical error, where no uncertainty raster says another,
  double dem_correlation_m = 10.0;  ///< correlated over this distance (patches and filter)
  bool alike_errors = true;         ///< height factors within that distance share an error: each weighs less for it
  /// Tie to the most probable terrain instead of the DEM as it is, where that can be told (dem/wiener.h).
  bool filter_dem = false;
  bool estimate_noise = false;    ///< where patches show the DEM to be noisier than stated, believe them (DemNoise)
  double sigma_contact_m = 0.15;  ///< ground within a cell of 5 m against the cell's height, added in quadrature; on
                                  ///< other cells as relief_within() says
  bool normal = true;             ///< the normal factor
  double sigma_normal_deg = 4.0;  ///< the DEM's slope error and wheelbase against cell
  double kernel_sigmas = 2.5;     ///< Cauchy, of height and normal
  bool full_gradient = true;      ///< false: the published height factor, whose Jacobian has only its vertical part
  bool gate =
      true;  ///< slopes only where they are surer than the DEM's error, normals only where the place is sure enough
  double max_tilt_deg = 60.0;  ///< a keyframe estimated steeper than this gets no normal factor
  bool patches = false;        ///< terrain patches from landmarks; the surest position, needs add_landmarks()
  PatchOptions patch;
  PatchFactorOptions patch_factor;
  SubmapOptions submap;        ///< search of whole submaps; needs add_landmarks()
  double sigma_bias_m = 0.0;   ///< of the DEM as a whole, up or down: a state; 0: none
  double sigma_shift_m = 0.0;  ///< and aside, per axis
  /// A start that is vaguer than this (one sigma, horizontal) is looked for before anything is tied to the DEM, whose
  /// factors would pull it into the next valley; 0: never.
  double vague_start_m = 0.0;

  bool needs_landmarks() const { return patches || submap.recover || submap.factors; }
};

/// How far the whole DEM is displaced, as estimated: East, North, Up.
struct DemShift {
  Eigen::Vector3d metres;
  Eigen::Matrix3d covariance;

  Eigen::Vector3d sigma_m() const { return covariance.diagonal().cwiseSqrt(); }
  std::string text() const;  ///< one line
};

/// What became of the keyframes that were due.
struct AnchoringReport {
  std::string start_search;  ///< empty: the start was known; "found", or "no fix: " and why
  int height = 0, normal = 0;
  int skipped_outside = 0;  ///< outside the DEM or at a hole, at the estimate of that moment
  int skipped_tilt = 0;     ///< height factor only
  int skipped_vague = 0;    ///< no normal factor: within the position's uncertainty the slope may be any
  int gated_heights = 0, gated_patches = 0;  ///< factors whose slopes were not believed: vertical only
  int patches = 0, patch_cells = 0;
  int skipped_patches = 0;   ///< stretches of path with too little ground seen on the DEM
  double noise_scale = 1.0;  ///< the DEM's error as the patches show it, over what was stated
  SubmapReport submaps;
};

/// Adds DEM factors to keyframes as they come. The DEM lies in the graph's map frame, but for the shift.
class DemAnchor {
 public:
  DemAnchor(std::shared_ptr<const Dem> dem, const AnchoringOptions& options, const Eigen::Vector3d& p_body_ground,
            const Pose& T_body_left = {});

  /// Before the first update(): nothing is tied until this search has found the place.
  void search_start(const StartSearchOptions& options);
  bool needs_landmarks() const { return start_search_ || options_.needs_landmarks(); }
  /// Ground points of a keyframe that update() has not seen yet.
  void add_landmarks(KeyframeLandmarks landmarks);
  /// Looks at every keyframe of the graph that it has not seen yet, at its present estimate. True when the estimate was
  /// moved to another place.
  bool update(PoseGraph& graph);
  /// How the graph was moved when the search for its start found it.
  const std::optional<Pose>& start_correction() const { return start_correction_; }
  AnchoringReport report() const;
  /// Nothing without such states, or before the first factor.
  std::optional<DemShift> dem_shift(const PoseGraph& graph) const;

 private:
  bool find_start(PoseGraph& graph);
  void tie(PoseGraph& graph);
  void anchor(PoseGraph& graph, std::size_t keyframe);
  void add_normal(PoseGraph& graph, std::size_t keyframe, const DemSample& ground);
  TerrainGradient believed_slope(const DemSample& ground);
  TerrainGradient believed_relief(const TerrainPatch& patch, const Pose& T_map_body);
  double horizontal_sigma_m(const PoseGraph& graph);
  void close_stretch(PoseGraph& graph, std::size_t end);
  std::optional<std::uint64_t> dem_shift_key(PoseGraph& graph);

  std::shared_ptr<const Dem> given_;
  AnchoringOptions options_;
  BelievedTerrain terrain_;
  BelievedDem here_;  ///< of that, around what is being tied
  Eigen::Vector3d p_body_ground_;
  Pose T_body_left_;
  AnchoringReport report_;
  PatchOptions patch_;  ///< fitted to the DEM's cells
  double sigma_contact_m_ = 0.0;
  std::size_t seen_ = 0, stretch_begin_ = 0;
  double path_since_anchor_m_ = 0.0, stretch_m_ = 0.0;
  std::vector<KeyframeLandmarks> landmarks_;  ///< of the open stretch and later
  std::optional<StartSearch> start_search_;   ///< until the start is found
  std::size_t searched_ = 0;                  ///< keyframes that the search has come to
  std::optional<Pose> start_correction_;
  std::optional<SubmapRecovery> submaps_;
  double relief_evidence_ = 0.0;  ///< of the last patches: how much better the DEM's relief explains them than a plane
  double path_m_ = 0.0, sigma_known_at_m_ = 0.0;
  std::optional<double> horizontal_sigma_m_;  ///< at sigma_known_at_m_
  std::optional<std::uint64_t> dem_shift_;    ///< the graph's key of the DEM's bias and shift
};

/// All keyframes of a graph at once.
AnchoringReport add_dem_factors(PoseGraph& graph, std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                                const Eigen::Vector3d& p_body_ground);

}  // namespace demslam

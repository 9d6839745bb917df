#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "demslam/graph/pose_graph.h"
#include "demslam/odometry/odometry.h"

namespace demslam {

struct LoopOptions {
  double radius_m = 4.0;                     ///< candidates: nearer than this plus three sigma of the present position
  double max_radius_m = 30.0;                ///< and never farther than this
  double min_path_m = 30.0;                  ///< path driven between the two keyframes
  double max_heading_difference_deg = 50.0;  ///< the cameras must see the same side
  int max_candidates = 3;                    ///< verified per keyframe, nearest first
  int min_inliers = 25;
  double gate = 22.46;  ///< chi-square of 6 degrees of freedom, 99.9 %
  double sigma_floor_m = 0.02,
         sigma_floor_deg = 0.1;  ///< added to the measured covariance: matched points share errors
};

enum class LoopStatus { accepted, not_matched, inconsistent };

/// One candidate's fate.
struct LoopResult {
  LoopStatus status = LoopStatus::not_matched;
  std::string reason;
  RelativePose measurement;  ///< body to body; meaningful unless not_matched
  double chi_square = 0.0;
  int inliers = 0;
};

struct LoopCounters {
  int proposed = 0, verified = 0, accepted = 0, rejected = 0;
};

/// Motion between the left cameras of two keyframes, given the graph's guess.
using LoopVerifier = std::function<Motion(std::size_t i, std::size_t j, const Pose& guess_T_left_i_left_j)>;
/// Features of an old keyframe; null where they are no longer kept.
using FeatureSource = std::function<std::shared_ptr<const StereoFeatures>(std::size_t keyframe)>;

/// Verification by matching and PnP (estimate_motion). Keeps references to `rig` and `matcher`.
LoopVerifier stereo_verifier(const RectifiedRig& rig, FeatureSource features, Matcher& matcher,
                             const MotionOptions& options);

/// Proximity loop closure: old keyframes near the newest one by the present estimate and its covariance, verified by
/// their images, accepted only when the graph itself finds them plausible. Accepted ones are in the graph; the caller
/// optimises.
class LoopClosure {
 public:
  LoopClosure(const LoopOptions& options, const Pose& T_body_left, LoopVerifier verify);

  /// Tries to close loops at the newest keyframe.
  std::vector<LoopResult> close(PoseGraph& graph);
  const LoopCounters& counters() const { return counters_; }

 private:
  std::vector<std::size_t> candidates(const PoseGraph& graph);
  LoopResult attempt(const PoseGraph& graph, std::size_t i, std::size_t j) const;

  LoopOptions options_;
  Pose T_body_left_;
  LoopVerifier verify_;
  LoopCounters counters_;
  std::vector<double> path_m_;  ///< per keyframe: path driven when it was first seen here
};

}  // namespace demslam

#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/graph/keyframe_grid.h"
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
  double gate = 44.9;  ///< chi-square against the graph: 6 degrees of freedom, 99.9 %, of twice the covariance, since
                       ///< what odometry adds up over kilometres is not known any better
  double sigma_floor_m = 0.02,
         sigma_floor_deg = 0.1;       ///< added to the measured covariance: matched points share errors
  int confirming_keyframes = 3;       ///< a loop counts once loops of this many keyframes agree, its own included,
  double confirming_path_m = 4.0;     ///< along at least this much path: no single view, however often it is taken for
                                      ///< another, closes a loop
  double confirming_radius_m = 20.0;  ///< and at most this much
  double agreement_gate = 12.59;      ///< chi-square between two loops that agree, 95 %
  double spacing_m = 5.0;             ///< path after accepted loops without trying for others
  bool appearance = true;             ///< where the position says less than max_radius_m: candidates by their looks

  Matrix6d floor_covariance() const;
};

enum class LoopStatus {
  accepted,      ///< in the graph, and on
  unconfirmed,   ///< plausible, waiting for other loops that agree
  not_matched,   ///< the images do not show it
  inconsistent,  ///< neither the graph nor the odometry can believe it
  rejected,      ///< nobody confirmed it
  switched_off   ///< accepted once, contradicted later; it may come back as accepted
};

/// One candidate's fate.
struct LoopResult {
  LoopStatus status = LoopStatus::not_matched;
  std::string reason;
  RelativePose measurement;  ///< body to body; meaningful unless not_matched
  double chi_square = 0.0;
  int inliers = 0;
};

/// Every candidate is proposed; of those the images verify, each ends up accepted, rejected (at once or unconfirmed),
/// or still waits. `rejected_later`: accepted, and switched off at present.
struct LoopCounters {
  int proposed = 0, verified = 0, accepted = 0, rejected = 0, rejected_later = 0;
};

/// Motion between the left cameras of two keyframes, given the graph's guess.
using LoopVerifier = std::function<Motion(std::size_t i, std::size_t j, const Pose& guess_T_left_i_left_j)>;
/// Features of an old keyframe; null where they are no longer kept.
using FeatureSource = std::function<std::shared_ptr<const StereoFeatures>(std::size_t keyframe)>;

/// Verification by matching and PnP (estimate_motion). Keeps references to `rig` and `matcher`.
LoopVerifier stereo_verifier(const RectifiedRig& rig, FeatureSource features, Matcher& matcher,
                             const MotionOptions& options);

/// Keyframes before number `end` that look like this one, best first; for when the position says too little.
using AppearanceSource = std::function<std::vector<std::size_t>(std::size_t keyframe, std::size_t end)>;

/// Loop closure that prefers none to a false one. Old keyframes near the newest one by the present estimate and its
/// covariance (or, where three sigma exceed the largest radius, those that look like it) are verified by their images;
/// what is plausible waits until other keyframes' loops agree with it, pairwise, through the odometry between them.
/// Such a group enters the graph as one loop, right or wrong as a whole. The caller optimises; every batch holds
/// each group against all the rest of the graph and switches off what does not fit.
class LoopClosure {
 public:
  LoopClosure(const LoopOptions& options, const Pose& T_body_left, LoopVerifier verify,
              AppearanceSource appearance = nullptr);

  /// Tries to close loops at the newest keyframe. Returns what was tried now, and earlier loops whose status changed
  /// since the last call.
  std::vector<LoopResult> close(PoseGraph& graph);
  /// What the images say of an old keyframe and the newest one, from whatever source; decided on by the next close().
  LoopResult consider(const PoseGraph& graph, std::size_t i, const Motion& motion);
  /// Accepted loops that the graph has switched off, or on again, since it was last asked.
  std::vector<LoopResult> review(const PoseGraph& graph);
  const LoopCounters& counters() const { return counters_; }

 private:
  /// Loops that agree; one in the graph.
  struct Group {
    std::vector<LoopResult> members;
    std::size_t loop = 0;  ///< its index in the graph
  };

  /// A plausible loop without a group, and which of those that came before it agree with it. They are compared once:
  /// the short ways between their keyframes hardly change.
  struct Waiting {
    LoopResult loop;
    std::uint64_t number = 0;
    std::vector<std::uint64_t> agrees_with;  ///< numbers, increasing
  };

  void index_until(const PoseGraph& graph, std::size_t end);
  std::vector<std::size_t> near(const PoseGraph& graph);
  std::vector<std::size_t> candidates(const PoseGraph& graph);
  LoopResult attempt(const PoseGraph& graph, std::size_t i);
  LoopResult measured(const PoseGraph& graph, std::size_t i, const Motion& motion) const;
  void judge(const PoseGraph& graph, LoopResult& result) const;
  void wait(const PoseGraph& graph, const LoopResult& loop);
  bool agree(const PoseGraph& graph, const RelativePose& a, const RelativePose& b) const;
  std::vector<std::size_t> agreeing(std::size_t first) const;
  bool is_confirmed(const PoseGraph& graph, const std::vector<std::size_t>& group) const;
  void confirm(PoseGraph& graph, std::vector<LoopResult>& changed);
  void accept(PoseGraph& graph, const std::vector<std::size_t>& group, std::vector<LoopResult>& changed);
  void expire(const PoseGraph& graph, std::vector<LoopResult>& changed);

  LoopOptions options_;
  Pose T_body_left_;
  LoopVerifier verify_;
  AppearanceSource appearance_;
  LoopCounters counters_;
  KeyframeGrid grid_;                                     ///< of keyframes far enough behind
  std::size_t indexed_ = 0, batches_ = 0, reviewed_ = 0;  ///< batches: of the graph, when last looked at
  std::vector<Waiting> waiting_;                          ///< in the order of their coming
  std::uint64_t came_ = 0;                                ///< how many ever waited
  std::vector<Group> groups_;
  double quiet_until_m_ = 0.0;  ///< path
};

}  // namespace demslam

#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "demslam/graph/loop_closure.h"
#include "demslam/store/map_store.h"

namespace demslam {

/// Motion from an old view to the newest keyframe, given a guess.
using ViewVerifier = std::function<Motion(std::size_t old_view, const Pose& guess_T_left_old_left_new)>;

/// A camera's motion as a measurement between bodies, with the floor that all loops have.
RelativePose body_measurement(const Motion& motion, const Pose& T_body_left, const LoopOptions& options);

/// After a loss: ties the first keyframes behind it to those before it, where they show the same ground, so that the
/// graph need not live with the dead reckoning in between.
class Relocaliser {
 public:
  static constexpr std::size_t kTries = 4;   ///< keyframes behind the loss
  static constexpr std::size_t kBefore = 6;  ///< keyframes before it, newest first

  Relocaliser(const LoopOptions& options, const Pose& T_body_left) : options_(options), T_body_left_(T_body_left) {}

  /// For every new keyframe; `lost`: it was bridged. Loops found are in the graph.
  std::vector<LoopResult> look(PoseGraph& graph, bool lost, const ViewVerifier& verify);
  int found() const { return found_; }

 private:
  LoopResult attempt(const PoseGraph& graph, std::size_t old_view, const ViewVerifier& verify) const;

  LoopOptions options_;
  Pose T_body_left_;
  std::optional<std::size_t> first_behind_;  ///< keyframe behind the loss that is still to be tied
  int found_ = 0;
};

/// The keyframes of an earlier run's map, in the same map frame: a keyframe of the present run that shows the ground of
/// one of them is placed by it. They are held, as known as their own run left them.
class EarlierMap {
 public:
  static constexpr double kEvery_m = 5.0;      ///< path between two looks, once placed
  static constexpr std::size_t kAtStart = 40;  ///< candidates per keyframe until placed for the first time
  static constexpr std::size_t kOnTheWay = 3;

  /// Throws Error when the map's rig is another one.
  EarlierMap(const std::filesystem::path& file, const RectifiedRig& rig, const LoopOptions& options);

  /// For every new keyframe. What was found is in the graph, as a pose with its covariance.
  std::vector<LoopResult> look(PoseGraph& graph, const ViewVerifier& verify);
  std::shared_ptr<const StereoFeatures> features(std::size_t keyframe) const { return map_.features(keyframe); }
  int found() const { return found_; }

 private:
  std::vector<std::size_t> candidates(const Pose& T_map_body, const Matrix6d& covariance) const;
  LoopResult attempt(PoseGraph& graph, std::size_t old_view, const Matrix6d& covariance, const ViewVerifier& verify);

  MapStore map_;
  Pose T_body_left_;
  LoopOptions options_;
  std::vector<StoredEstimate> keyframes_;
  Pose T_map_body_found_;  ///< where the last one was found
  int found_ = 0;
};

}  // namespace demslam

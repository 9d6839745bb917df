#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/anchoring/start_search.h"
#include "demslam/dataset/sun_sensor.h"
#include "demslam/dem/dem.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/slam/options.h"
#include "demslam/slam/relocalisation.h"

namespace demslam {

/// A frame, held relative to its keyframe so that it moves along with it.
struct FramePlace {
  TimestampNs t_ns = 0;
  std::size_t keyframe = 0;
  Pose T_keyframe_body;
};

/// What a keyframe brought to the graph.
struct KeyframeRecord {
  std::optional<RelativePose> odometry;  ///< body to body; none for the first keyframe
  std::vector<LoopResult> loops;         ///< every candidate that was tried
  std::vector<LoopResult> earlier_map;   ///< the same among the keyframes of --map; `i` counts those
  std::vector<Motion> verified;          ///< what the images said of them, in the order of asking
};

/// What happened at one frame; one line of frames.jsonl.
struct FrameRecord {
  std::size_t index = 0;
  OdometryResult odometry;
  FramePlace place;
  Pose T_map_body;  ///< present estimate
  std::optional<KeyframeRecord> keyframe;
  std::optional<LoopResult> loop;  ///< the best candidate that was tried, if any
  bool optimized = false;
  double loop_ms = 0.0, optimize_ms = 0.0, store_ms = 0.0;
  double total_ms = 0.0;  ///< all stages; a frame is extracted and matched left to right beside the one before
};

struct KeyframeEstimate {
  TimestampNs t_ns = 0;
  Pose T_map_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation
};

struct SlamCounters {
  std::size_t frames = 0, tracked = 0, bridged = 0, keyframes = 0;
  LoopCounters loops;
  int relocalised = 0;     ///< losses behind which an older keyframe was seen again
  int in_earlier_map = 0;  ///< keyframes placed by the map of an earlier run
  AnchoringReport anchoring;
  std::size_t suns = 0;  ///< keyframes that saw the sun
};

struct SlamResult {
  Trajectory trajectory;  ///< T_map_body of every tracked frame, after the last optimisation
  Trajectory odometry;    ///< the same frames from odometry alone
  std::vector<KeyframeEstimate> keyframes;
  std::vector<FactorResidual> residuals;  ///< of all factors but odometry and loops (anchoring/factor_kind.h)
  std::optional<DemShift> dem_shift;      ///< against the map frame, in which the start is known
  SlamCounters counters;
};

/// What the mission knows of the first pose.
struct StartPrior {
  Pose T_map_body;
  Matrix6d covariance = Matrix6d::Identity();
  /// Instead of that: nothing, but that the start is somewhere in there. Needs a DEM.
  std::optional<StartSearchOptions> search = std::nullopt;
};

/// What follows the odometry: keyframe -> DEM factors -> loop closure -> optimisation. Sees no image, so that one
/// odometry can feed several back-ends. Synchronous and deterministic.
class Backend {
 public:
  /// `dem` may be null; `matcher` serves loop closure and is kept by reference. `stored` gives the features of old
  /// keyframes back; without it they stay in memory. Throws Error when the DEM has no height at the start.
  Backend(const RectifiedRig& rig, Matcher& matcher, std::shared_ptr<const Dem> dem, const StartPrior& start,
          const SlamOptions& options, FeatureSource stored = {});
  /// Sun directions with both vectors, in increasing time; a keyframe takes the nearest within half a second. Call
  /// before the first result.
  void set_sun(std::vector<SunMeasurement> sun);
  ~Backend();

  /// Results of one odometry, every frame in turn.
  FrameRecord add(const OdometryResult& result);
  /// Also looks for the rover in the map of an earlier run.
  void use(std::unique_ptr<EarlierMap> map);

  /// Repeats add() of a keyframe of an earlier run with what its images said then, to the same bits.
  void repeat(const OdometryResult& keyframe, std::vector<Motion> verified);
  /// The same for any other frame.
  void repeat(const FramePlace& frame, Tracking status);

  std::size_t keyframes() const;
  Pose T_map_keyframe(std::size_t keyframe) const;           ///< present estimate
  Pose T_map_keyframe_odometry(std::size_t keyframe) const;  ///< by odometry alone
  /// The last batch optimisation and everything estimated so far.
  SlamResult finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam

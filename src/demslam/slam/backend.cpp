#include "demslam/slam/backend.h"

#include <algorithm>
#include <utility>

#include "demslam/base/error.h"
#include "demslam/graph/pose_graph.h"

namespace demslam {
namespace {

/// A tracked frame, held relative to its keyframe so that it moves along with it.
struct TrackedFrame {
  TimestampNs t_ns = 0;
  std::size_t keyframe = 0;
  Pose T_keyframe_body;
};

struct Keyframe {
  TimestampNs t_ns = 0;
  Pose T_map_body_odometry;  ///< by odometry alone
  std::shared_ptr<const StereoFeatures> features;
};

void check_start_on_dem(const Dem& dem, const Pose& T_map_body) {
  const Eigen::Vector3d& p = T_map_body.translation();
  if (dem.covers(p.x(), p.y())) return;
  const MapWindow extent = dem.raster().extent();
  throw Error("the DEM has no height at the start (" + std::to_string(p.x()) + ", " + std::to_string(p.y()) +
              ") m: outside, or on a hole; it covers x " + std::to_string(extent.west_m) + " to " +
              std::to_string(extent.east_m) + ", y " + std::to_string(extent.south_m) + " to " +
              std::to_string(extent.north_m) + " m of the map (check --dem and --start)");
}

}  // namespace

struct Backend::State {
  RectifiedRig rig;
  Matcher& matcher;
  SlamOptions options;
  std::shared_ptr<const Dem> dem;
  StartPrior start;
  PoseGraph graph;
  LoopClosure loops;
  std::optional<DemAnchor> anchor;  ///< none without a DEM
  std::vector<Keyframe> keyframes;
  std::vector<TrackedFrame> frames;
  SlamCounters counters;

  State(const RectifiedRig& rectified_rig, Matcher& features_matcher, std::shared_ptr<const Dem> elevation,
        const StartPrior& prior, const SlamOptions& o)
      : rig(rectified_rig),
        matcher(features_matcher),
        options(o),
        dem(std::move(elevation)),
        start(prior),
        graph(o.graph),
        loops(o.loops, rig.T_body_left, verifier()) {
    if (dem) anchor.emplace(dem, o.anchoring, rig.p_body_ground, rig.T_body_left);
  }

  LoopVerifier verifier() {
    const auto features = [this](std::size_t keyframe) { return keyframes[keyframe].features; };
    return stereo_verifier(rig, features, matcher, options.odometry.motion);
  }

  Pose T_reference_body(const OdometryResult& result) const {
    return rig.T_body_left * result.T_reference_left * rig.T_body_left.inverse();
  }

  /// The odometry's measurement between two keyframes, moved from the camera to the body.
  RelativePose measurement(const OdometryResult& result) const {
    const Matrix6d ad = rig.T_body_left.adjoint();
    return {result.reference_keyframe, result.keyframe, T_reference_body(result),
            ad * result.covariance * ad.transpose()};
  }

  void add_first_keyframe(const OdometryResult& result) {
    graph.add_keyframe(start.T_map_body);
    graph.add_prior(0, start.T_map_body, start.covariance);
    keyframes.push_back({result.t_ns, start.T_map_body, result.features});
  }

  void add_keyframe(const OdometryResult& result) {
    const RelativePose odometry_ij = measurement(result);
    graph.add_keyframe(graph.T_map_body(odometry_ij.i) * graph.corrected_odometry(odometry_ij));
    graph.add_odometry(odometry_ij);
    keyframes.push_back(
        {result.t_ns, keyframes[odometry_ij.i].T_map_body_odometry * odometry_ij.T_i_j, result.features});
  }

  void anchor_keyframe(const OdometryResult& result) {
    if (!anchor) return;
    if (options.anchoring.patches) {
      anchor->add_landmarks(
          ground_landmarks(result.keyframe, rig, *result.features, options.odometry.motion, options.landmarks));
    }
    anchor->update(graph);
  }

  void track(const OdometryResult& result) {
    const std::size_t keyframe = result.is_keyframe ? result.keyframe : result.reference_keyframe;
    ++counters.frames;
    if (result.status == Tracking::bridged) {
      ++counters.bridged;
      return;
    }
    ++counters.tracked;
    frames.push_back({result.t_ns, keyframe, result.is_keyframe ? Pose() : T_reference_body(result)});
  }

  /// The accepted candidate, else the best of those that were tried.
  std::optional<LoopResult> close_loops() {
    const std::vector<LoopResult> results = loops.close(graph);
    if (results.empty()) return std::nullopt;
    return *std::min_element(results.begin(), results.end(),
                             [](const auto& a, const auto& b) { return a.status < b.status; });
  }

  bool optimization_is_due(const std::optional<LoopResult>& loop) const {
    if (loop && loop->status == LoopStatus::accepted) return true;
    return options.optimize_every_keyframes > 0 && graph.size() % options.optimize_every_keyframes == 0;
  }

  Trajectory trajectory(const std::function<Pose(std::size_t)>& T_map_keyframe) const {
    Trajectory result;
    for (const TrackedFrame& frame : frames) {
      result.push_back({frame.t_ns, T_map_keyframe(frame.keyframe) * frame.T_keyframe_body});
    }
    return result;
  }

  std::vector<KeyframeEstimate> keyframe_estimates() const {
    std::vector<std::size_t> all(keyframes.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    const std::vector<Matrix6d> covariances = graph.covariances(all);
    std::vector<KeyframeEstimate> estimates;
    for (const std::size_t i : all) estimates.push_back({keyframes[i].t_ns, graph.T_map_body(i), covariances[i]});
    return estimates;
  }
};

Backend::Backend(const RectifiedRig& rig, Matcher& matcher, std::shared_ptr<const Dem> dem, const StartPrior& start,
                 const SlamOptions& options) {
  if (dem) check_start_on_dem(*dem, start.T_map_body);
  state_ = std::make_unique<State>(rig, matcher, std::move(dem), start, options);
}

Backend::~Backend() = default;

FrameRecord Backend::add(const OdometryResult& result) {
  State& s = *state_;
  FrameRecord record{.odometry = result};
  record.odometry.features.reset();
  if (result.is_keyframe) {
    result.keyframe == 0 ? s.add_first_keyframe(result) : s.add_keyframe(result);
    s.anchor_keyframe(result);
    const Stopwatch loop;
    if (s.options.use_loops) record.loop = s.close_loops();
    record.loop_ms = loop.elapsed_ms();
    const Stopwatch optimization;
    record.optimized = s.optimization_is_due(record.loop);
    if (record.optimized) s.graph.optimize();
    record.optimize_ms = optimization.elapsed_ms();
  }
  s.track(result);
  record.T_map_body = result.is_keyframe ? s.graph.T_map_body(result.keyframe)
                                         : s.graph.T_map_body(result.reference_keyframe) * s.T_reference_body(result);
  return record;
}

SlamResult Backend::finish() {
  State& s = *state_;
  SlamResult result;
  if (s.keyframes.empty()) return result;
  s.graph.optimize();
  result.trajectory = s.trajectory([&](std::size_t k) { return s.graph.T_map_body(k); });
  result.odometry = s.trajectory([&](std::size_t k) { return s.keyframes[k].T_map_body_odometry; });
  result.keyframes = s.keyframe_estimates();
  result.counters = s.counters;
  result.counters.keyframes = s.keyframes.size();
  result.counters.loops = s.loops.counters();
  if (s.anchor) result.counters.anchoring = s.anchor->report();
  return result;
}

}  // namespace demslam

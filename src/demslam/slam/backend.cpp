#include "demslam/slam/backend.h"

#include <algorithm>
#include <deque>
#include <iterator>
#include <utility>

#include "demslam/anchoring/factor_kind.h"
#include "demslam/anchoring/sky_factors.h"
#include "demslam/base/error.h"
#include "demslam/graph/appearance.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/slam/feature_cache.h"

namespace demslam {
namespace {

struct Keyframe {
  TimestampNs t_ns = 0;
  Pose T_map_body_odometry;  ///< by odometry alone
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

/// The accepted candidate, else the best of those that were tried.
std::optional<LoopResult> best_of(const std::vector<LoopResult>& loops) {
  if (loops.empty()) return std::nullopt;
  return *std::min_element(loops.begin(), loops.end(),
                           [](const auto& a, const auto& b) { return a.status < b.status; });
}

bool has_accepted(const std::vector<LoopResult>& loops) {
  return std::ranges::any_of(loops, [](const LoopResult& loop) { return loop.status == LoopStatus::accepted; });
}

}  // namespace

struct Backend::State {
  RectifiedRig rig;
  Matcher& matcher;
  SlamOptions options;
  FeatureCache features;
  std::shared_ptr<const Dem> dem;
  StartPrior start;
  PoseGraph graph;
  std::optional<Appearance> appearance;
  LoopClosure loops;
  Relocaliser relocaliser;
  std::unique_ptr<EarlierMap> earlier_map;
  std::optional<DemAnchor> anchor;  ///< none without a DEM
  std::vector<SunMeasurement> sun;
  std::vector<Keyframe> keyframes;
  std::vector<FramePlace> frames;  ///< tracked ones
  SlamCounters counters;
  std::vector<Motion> verified;               ///< at the newest keyframe
  std::optional<std::deque<Motion>> earlier;  ///< what to repeat instead of verifying anew

  State(const RectifiedRig& rectified_rig, Matcher& features_matcher, std::shared_ptr<const Dem> elevation,
        const StartPrior& prior, const SlamOptions& o, FeatureSource stored)
      : rig(rectified_rig),
        matcher(features_matcher),
        options(o),
        features(std::move(stored)),
        dem(std::move(elevation)),
        start(prior),
        graph(o.graph),
        loops(o.loops, rig.T_body_left, verifier(), look_alikes()),
        relocaliser(o.loops, rig.T_body_left) {
    if (!dem) return;
    anchor.emplace(dem, o.anchoring, rig.p_body_ground, rig.T_body_left);
    const auto search = start.search
                            ? start.search
                            : search_for_vague_start(start.T_map_body, start.covariance, o.anchoring.vague_start_m);
    if (search) anchor->search_start(*search);
  }

  /// Asks the images, or what they said in the run that is repeated.
  Motion verify(const std::function<std::shared_ptr<const StereoFeatures>()>& old_view, std::size_t j,
                const Pose& guess) {
    verified.push_back(
        earlier ? next_earlier()
                : estimate_motion(rig, *old_view(), *features.at(j), matcher, options.odometry.motion, &guess));
    return verified.back();
  }

  LoopVerifier verifier() {
    return [this](std::size_t i, std::size_t j, const Pose& guess) {
      return verify([this, i] { return features.at(i); }, j, guess);
    };
  }

  AppearanceSource look_alikes() {
    if (!options.use_loops || !options.loops.appearance) return nullptr;
    appearance.emplace([this](std::size_t keyframe) { return features.glance_at(keyframe); });
    return [this](std::size_t keyframe, std::size_t end) {
      return appearance->like(keyframe, end, static_cast<std::size_t>(options.loops.max_candidates));
    };
  }

  Motion next_earlier() {
    if (earlier->empty()) throw Error("the stored run does not repeat itself: it was made by another build of demslam");
    Motion motion = std::move(earlier->front());
    earlier->pop_front();
    return motion;
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

  void start_graph(const OdometryResult& result) {
    graph.add_keyframe(start.T_map_body);
    graph.add_prior(0, start.T_map_body, start.covariance);
    keyframes.push_back({result.t_ns, start.T_map_body});
  }

  void extend_graph(const OdometryResult& result, const RelativePose& odometry_ij) {
    graph.add_keyframe(graph.T_map_body(odometry_ij.i) * graph.corrected_odometry(odometry_ij));
    graph.add_odometry(odometry_ij);
    keyframes.push_back({result.t_ns, keyframes[odometry_ij.i].T_map_body_odometry * odometry_ij.T_i_j});
  }

  void see_sun(const OdometryResult& result) {
    constexpr TimestampNs kHalfSecond = 500'000'000;
    const auto later = std::ranges::lower_bound(sun, result.t_ns - kHalfSecond, {}, &SunMeasurement::t_ns);
    const auto end = std::ranges::upper_bound(sun, result.t_ns + kHalfSecond, {}, &SunMeasurement::t_ns);
    const auto nearest = std::min_element(later, end, [&](const SunMeasurement& a, const SunMeasurement& b) {
      return std::abs(a.t_ns - result.t_ns) < std::abs(b.t_ns - result.t_ns);
    });
    if (nearest == end || !nearest->sun_map) return;
    graph.add_factor(sun_factor(result.keyframe, *nearest->sun_map, nearest->sun_body, nearest->sigma_deg));
    ++counters.suns;
  }

  /// True when the estimate was moved to another place.
  bool anchor_keyframe(const OdometryResult& result) {
    if (!anchor) return false;
    if (anchor->needs_landmarks()) {
      const auto seen = features.at(result.keyframe);
      anchor->add_landmarks(ground_landmarks(result.keyframe, rig, *seen, options.odometry.motion, options.landmarks));
    }
    const bool placed = anchor->start_correction().has_value();
    const bool moved = anchor->update(graph);
    if (start.search && !placed && anchor->start_correction()) move_odometry(*anchor->start_correction());
    return moved;
  }

  /// Of a frame of its own, into the map.
  void move_odometry(const Pose& T_map_own) {
    for (Keyframe& k : keyframes) k.T_map_body_odometry = T_map_own * k.T_map_body_odometry;
  }

  FramePlace place(const OdometryResult& result) const {
    if (result.is_keyframe) return {result.t_ns, result.keyframe, Pose()};
    return {result.t_ns, result.reference_keyframe, T_reference_body(result)};
  }

  void track(const FramePlace& frame, Tracking status) {
    ++counters.frames;
    const bool lost = status == Tracking::bridged;
    ++(lost ? counters.bridged : counters.tracked);
    if (!lost) frames.push_back(frame);
  }

  void close_loops(bool lost, KeyframeRecord& keyframe) {
    verified.clear();
    const std::size_t newest = graph.size() - 1;
    if (earlier_map) {
      keyframe.earlier_map = earlier_map->look(graph, [&](std::size_t old_view, const Pose& guess) {
        return verify([&] { return earlier_map->features(old_view); }, newest, guess);
      });
    }
    if (options.use_loops) {
      keyframe.loops = relocaliser.look(graph, lost, [&](std::size_t old_view, const Pose& guess) {
        return verify([&] { return features.at(old_view); }, newest, guess);
      });
      std::ranges::copy(loops.close(graph), std::back_inserter(keyframe.loops));
    }
    keyframe.verified = std::move(verified);
  }

  void add_keyframe(const OdometryResult& result, FrameRecord& record) {
    KeyframeRecord& keyframe = record.keyframe.emplace();
    if (result.features) features.add(result.keyframe, result.features);
    if (result.keyframe == 0) {
      start_graph(result);
    } else {
      keyframe.odometry = measurement(result);
      extend_graph(result, *keyframe.odometry);
    }
    if (options.use_sun) see_sun(result);
    if (appearance && result.features) appearance->see(result.keyframe);
    const bool moved = anchor_keyframe(result);
    const Stopwatch loop;
    close_loops(result.status == Tracking::bridged, keyframe);
    record.loop = best_of(keyframe.loops);
    record.loop_ms = loop.elapsed_ms();
    const Stopwatch optimization;
    record.optimized =
        moved || optimization_is_due(record.loop) || has_accepted(keyframe.earlier_map) || graph.batch_is_ready();
    if (record.optimized) moved ? graph.optimize() : graph.optimize_recent();
    record.optimize_ms = optimization.elapsed_ms();
  }

  bool optimization_is_due(const std::optional<LoopResult>& loop) const {
    if (loop && loop->status == LoopStatus::accepted) return true;
    return options.optimize_every_keyframes > 0 && graph.size() % options.optimize_every_keyframes == 0;
  }

  Trajectory trajectory(const std::function<Pose(std::size_t)>& T_map_keyframe) const {
    Trajectory result;
    for (const FramePlace& frame : frames) {
      result.push_back({frame.t_ns, T_map_keyframe(frame.keyframe) * frame.T_keyframe_body});
    }
    return result;
  }

  std::vector<KeyframeEstimate> keyframe_estimates() const {
    std::vector<std::size_t> all(keyframes.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    const std::vector<Matrix6d> covariances = graph.covariances(all);
    std::vector<KeyframeEstimate> estimates;
    estimates.reserve(all.size());
    for (const std::size_t i : all) estimates.push_back({keyframes[i].t_ns, graph.T_map_body(i), covariances[i]});
    return estimates;
  }
};

Backend::Backend(const RectifiedRig& rig, Matcher& matcher, std::shared_ptr<const Dem> dem, const StartPrior& start,
                 const SlamOptions& options, FeatureSource stored) {
  if (start.search && !dem) throw Error("a search for the start needs a DEM; pass --dem FILE");
  if (dem && !start.search) check_start_on_dem(*dem, start.T_map_body);
  state_ = std::make_unique<State>(rig, matcher, std::move(dem), start, options, std::move(stored));
}

Backend::~Backend() = default;

void Backend::set_sun(std::vector<SunMeasurement> sun) { state_->sun = std::move(sun); }

FrameRecord Backend::add(const OdometryResult& result) {
  State& s = *state_;
  FrameRecord record{.odometry = result, .place = s.place(result)};
  if (result.is_keyframe) s.add_keyframe(result, record);
  s.track(record.place, result.status);
  record.T_map_body = s.graph.T_map_body(record.place.keyframe) * record.place.T_keyframe_body;
  return record;
}

void Backend::use(std::unique_ptr<EarlierMap> map) { state_->earlier_map = std::move(map); }

void Backend::repeat(const OdometryResult& keyframe, std::vector<Motion> verified) {
  state_->earlier.emplace(verified.begin(), verified.end());
  add(keyframe);
  state_->earlier.reset();
}

void Backend::repeat(const FramePlace& frame, Tracking status) { state_->track(frame, status); }

std::size_t Backend::keyframes() const { return state_->keyframes.size(); }
Pose Backend::T_map_keyframe(std::size_t keyframe) const { return state_->graph.T_map_body(keyframe); }
Pose Backend::T_map_keyframe_odometry(std::size_t keyframe) const {
  return state_->keyframes.at(keyframe).T_map_body_odometry;
}

SlamResult Backend::finish() {
  State& s = *state_;
  SlamResult result;
  if (s.keyframes.empty()) return result;
  s.graph.optimize();
  s.loops.review(s.graph);
  result.trajectory = s.trajectory([&](std::size_t k) { return s.graph.T_map_body(k); });
  result.odometry = s.trajectory([&](std::size_t k) { return s.keyframes[k].T_map_body_odometry; });
  result.keyframes = s.keyframe_estimates();
  result.residuals = s.graph.residuals(factor_kind);
  result.counters = s.counters;
  result.counters.keyframes = s.keyframes.size();
  result.counters.loops = s.loops.counters();
  result.counters.relocalised = s.relocaliser.found();
  if (s.earlier_map) result.counters.in_earlier_map = s.earlier_map->found();
  if (s.anchor) {
    result.counters.anchoring = s.anchor->report();
    result.dem_shift = s.anchor->dem_shift(s.graph);
  }
  return result;
}

}  // namespace demslam

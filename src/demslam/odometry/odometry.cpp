#include "demslam/odometry/odometry.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "demslam/geometry/angle.h"
#include "demslam/odometry/disparity.h"
#include "demslam/odometry/frame_check.h"
#include "demslam/odometry/motion_search.h"
#include "demslam/odometry/window.h"

namespace demslam {
namespace {

constexpr int kIslandFrames = 10;  // frames tracked after a loss until the keyframe from before it is given up

struct Keyframe {
  std::size_t index = 0;
  TimestampNs t_ns = 0;
  StereoView view;
  int most_inliers = 0;  ///< of any frame tracked against it

  template <class Archive>
  friend void archive(Archive& io, Keyframe& k) {
    io(k.index, k.t_ns, k.view, k.most_inliers);
  }
};

/// A view whose pose is known, against which another can be tracked: a keyframe itself or a frame tracked from it.
struct View {
  std::size_t keyframe = 0;
  TimestampNs t_ns = 0;
  StereoView view;
  Pose T_keyframe_left;
  Matrix6d covariance = Matrix6d::Zero();  ///< of its right perturbation

  template <class Archive>
  friend void archive(Archive& io, View& v) {
    io(v.keyframe, v.t_ns, v.view, v.T_keyframe_left, v.covariance);
  }
};

View view_of(const Keyframe& keyframe) {
  return {.keyframe = keyframe.index, .t_ns = keyframe.t_ns, .view = keyframe.view};
}

/// Covariance of T_a_b * T_b_c from those of both.
Matrix6d compose_covariance(const Matrix6d& covariance_a_b, const Pose& T_b_c, const Matrix6d& covariance_b_c) {
  const Matrix6d ad = T_b_c.inverse().adjoint();
  return ad * covariance_a_b * ad.transpose() + covariance_b_c;
}

double rotation_angle(const Pose& T) { return T.log().head<3>().norm(); }

}  // namespace

std::string to_string(Tracking status) {
  switch (status) {
    case Tracking::initialised:
      return "initialised";
    case Tracking::tracked:
      return "tracked";
    case Tracking::bridged:
      return "bridged";
  }
  return "";
}

std::string to_string(OdometryMethod method) {
  switch (method) {
    case OdometryMethod::pnp:
      return "pnp";
    case OdometryMethod::keyframe:
      return "keyframe";
    case OdometryMethod::window:
      return "window";
  }
  return "";
}

std::optional<OdometryMethod> odometry_method(std::string_view word) {
  for (const OdometryMethod method : {OdometryMethod::pnp, OdometryMethod::keyframe, OdometryMethod::window}) {
    if (to_string(method) == word) return method;
  }
  return std::nullopt;
}

struct StereoOdometry::State {
  State(const RectifiedRig& rectified_rig, Frontend both, const OdometryOptions& all)
      : rig(rectified_rig),
        calibrated(rig),
        frontend(std::move(both)),
        options(all),
        dead_reckoning(options.lost, rig.T_body_left),
        vergence(options.method == OdometryMethod::window ? calibrated_vergence(options.self_calibration) : Vergence{}),
        window(options.motion, options.window_keyframes) {}

  RectifiedRig rig;         // as given
  RectifiedRig calibrated;  // with the vergence
  Frontend frontend;
  OdometryOptions options;
  FrozenCheck frozen_check;
  DeadReckoning dead_reckoning;
  Vergence vergence;  // learned by the window; without one the calibration is believed
  Window window;      // only kept up with OdometryMethod::window

  std::size_t keyframes = 0;
  StereoView current;                         // the frame in work
  Keyframe keyframe;                          // frames are tracked against it
  View last;                                  // the last tracked frame: predictions start here
  std::optional<TimestampNs> last_usable_ns;  // the pair that the frame check remembers
  Vector6d twist_per_s = Vector6d::Zero();
  struct Anchor {
    Keyframe keyframe;
    View last;
    Window window;
    int frames_since = 0;

    template <class Archive>
    friend void archive(Archive& io, Anchor& a) {
      io(a.keyframe, a.last, a.window, a.frames_since);
    }
  };
  std::optional<Anchor> before_loss;  // what to come back to after a loss

  Observation observe(TimestampNs t_ns, ImagePair pair) const;
  void look_at(Observation observation, OdometryResult& result);
  bool track(OdometryResult& result);
  bool track_against(const View& view, OdometryResult& result);
  Motion with_support(Motion motion, TimestampNs from_ns, TimestampNs to_ns) const;
  void tie_to_keyframe(OdometryResult& result) const;
  bool is_jump(const View& view, const Pose& T_view_left, TimestampNs t_ns) const;
  Pose predict(const View& view, TimestampNs t_ns) const;
  void accept(const OdometryResult& result);
  void bridge(OdometryResult& result) const;
  bool wants_keyframe(const OdometryResult& result) const;
  void add_keyframe(OdometryResult& result);
  void adjust_window(OdometryResult& result);
  std::shared_ptr<const StereoFeatures> without_vergence(std::shared_ptr<const StereoFeatures> features) const;

  template <class Archive>
  void archive(Archive& io);
  void restore_views(const PairSource& pair_at);
};

/// Extracts the left image's features and finds their disparities.
Observation StereoOdometry::State::observe(TimestampNs t_ns, ImagePair pair) const {
  Observation observation{.view = {.features = std::make_shared<StereoFeatures>(), .t_ns = t_ns},
                          .problem = problem_of(pair.left, pair.right, rig.width, rig.height)};
  if (!observation.problem.empty()) return observation;
  const Stopwatch extract;
  Features features = frontend.extractor->extract(pair.left);
  observation.timings.extract_ms = extract.elapsed_ms();
  const Stopwatch stereo;
  observation.view = {.features = std::make_shared<StereoFeatures>(
                          match_stereo(rig, std::move(features), pair.left, pair.right, options.motion)),
                      .left = std::make_shared<Image>(std::move(pair.left)),
                      .right = std::make_shared<Image>(std::move(pair.right)),
                      .t_ns = t_ns};
  observation.timings.stereo_ms = stereo.elapsed_ms();
  return observation;
}

/// Makes it the frame in work, if it shows anything.
void StereoOdometry::State::look_at(Observation observation, OdometryResult& result) {
  result.timings = observation.timings;
  result.reason = std::move(observation.problem);
  if (result.reason.empty() && frozen_check.is_frozen(observation.view.left, observation.view.right))
    result.reason = "frozen frame";
  if (!result.reason.empty()) {
    current = {.features = result.features, .t_ns = result.t_ns};
    return;
  }
  last_usable_ns = result.t_ns;
  current = std::move(observation.view);
  result.features = current.features;
  result.keypoints = static_cast<int>(current.features->left.size());
  result.stereo_points = points_with_depth(*current.features);
}

/// Tries what the frame may still share a view with: what was seen before a loss; the last frame, which is nearest; the
/// keyframe.
bool StereoOdometry::State::track(OdometryResult& result) {
  std::vector<View> views;
  if (before_loss) {
    views.push_back(view_of(before_loss->keyframe));
    views.push_back(before_loss->last);
  }
  if (last.keyframe == keyframe.index && last.t_ns > keyframe.t_ns) views.push_back(last);
  views.push_back(view_of(keyframe));
  return std::ranges::any_of(views, [&](const View& view) { return track_against(view, result); });
}

bool StereoOdometry::State::track_against(const View& view, OdometryResult& result) {
  const Pose guess = predict(view, result.t_ns);
  Motion motion =
      estimate_motion(calibrated, *view.view.features, *current.features, *frontend.matcher, options.motion, &guess);
  const bool by_patches = options.method != OdometryMethod::pnp;
  if (!refusal(motion, options.motion).empty()) {
    motion = search_motion(calibrated, view.view, current, guess, options.motion, by_patches).value_or(motion);
  }
  if (motion.ok && by_patches) motion = refine_directly(calibrated, view.view, current, motion, options.motion);
  motion = with_support(std::move(motion), view.t_ns, result.t_ns);
  result.matches = motion.matches;
  result.inliers = motion.inliers;
  result.rms_px = motion.rms_px;
  result.reason = refusal(motion, options.motion);
  if (!result.reason.empty()) return false;
  if (is_jump(view, motion.T_a_b, result.t_ns)) {
    result.reason = "jump";
    return false;
  }
  result.status = Tracking::tracked;
  result.reference_keyframe = view.keyframe;
  result.T_reference_left = view.T_keyframe_left * motion.T_a_b;
  result.covariance = compose_covariance(view.covariance, motion.T_a_b, motion.covariance);
  if (view.keyframe == keyframe.index && view.t_ns > keyframe.t_ns) tie_to_keyframe(result);
  return true;
}

/// Points that are all far away, as where the near ground lies in shadow, leave the translation open: dead reckoning
/// closes it.
Motion StereoOdometry::State::with_support(Motion motion, TimestampNs from_ns, TimestampNs to_ns) const {
  if (!motion.ok || !options.lost.support_weak) return motion;
  const ReckonedStep both =
      supported({motion.T_a_b, motion.covariance}, dead_reckoning.step(from_ns, to_ns, twist_per_s));
  motion.T_a_b = both.T_from_to;
  motion.covariance = both.covariance;
  return motion;
}

/// A pose found from the last frame says well enough where the keyframe's patches are: seen directly from the keyframe,
/// errors do not add up from frame to frame. Where too little of the keyframe is still in sight, the pose stays as it
/// is and the few inliers call for a new keyframe.
void StereoOdometry::State::tie_to_keyframe(OdometryResult& result) const {
  const Motion guess{.ok = true,
                     .T_a_b = result.T_reference_left,
                     .covariance = result.covariance,
                     .inliers = options.motion.min_inliers};
  const Motion tied = with_support(refine_directly(calibrated, keyframe.view, current, guess, options.motion),
                                   keyframe.t_ns, result.t_ns);
  const bool found = tied.matches > 0 && refusal(tied, options.motion).empty();
  result.inliers = found ? tied.inliers : 0;
  if (!found) return;
  result.matches = tied.matches;
  result.rms_px = tied.rms_px;
  result.T_reference_left = tied.T_a_b;
  result.covariance = tied.covariance;
}

/// Faster than the rover can be: since the last tracked frame, or since the view where that is from elsewhere.
bool StereoOdometry::State::is_jump(const View& view, const Pose& T_view_left, TimestampNs t_ns) const {
  const bool from_last = last.keyframe == view.keyframe && last.t_ns >= view.t_ns;
  const Pose step = from_last ? last.T_keyframe_left.inverse() * view.T_keyframe_left * T_view_left : T_view_left;
  const double seconds = to_seconds(t_ns - (from_last ? last.t_ns : view.t_ns));
  return step.translation().norm() > options.max_speed_m_per_s * seconds ||
         rotation_angle(step) > options.max_rotation_rate_deg_per_s * kRadPerDeg * seconds;
}

/// Where the frame should be, seen from a view, by dead reckoning.
Pose StereoOdometry::State::predict(const View& view, TimestampNs t_ns) const {
  if (last.keyframe != view.keyframe) return dead_reckoning.step(view.t_ns, t_ns, twist_per_s).T_from_to;
  return view.T_keyframe_left.inverse() * last.T_keyframe_left *
         dead_reckoning.step(last.t_ns, t_ns, twist_per_s).T_from_to;
}

/// Makes a tracked frame the one that predictions start from.
void StereoOdometry::State::accept(const OdometryResult& result) {
  if (before_loss && result.reference_keyframe == before_loss->keyframe.index) {
    keyframe = before_loss->keyframe;
    last = before_loss->last;
    window = before_loss->window;
    before_loss.reset();
  }
  if (before_loss && ++before_loss->frames_since >= kIslandFrames) before_loss.reset();
  const bool same_keyframe = last.keyframe == result.reference_keyframe;
  const View from = same_keyframe ? last : view_of(keyframe);
  const Pose step = from.T_keyframe_left.inverse() * result.T_reference_left;
  twist_per_s = step.log() / to_seconds(result.t_ns - from.t_ns);
  last = {.keyframe = result.reference_keyframe,
          .t_ns = result.t_ns,
          .view = current,
          .T_keyframe_left = result.T_reference_left,
          .covariance = result.covariance};
  keyframe.most_inliers = std::max(keyframe.most_inliers, result.inliers);
}

/// Predicts from the last tracked frame; the uncertainty grows with all the time since.
void StereoOdometry::State::bridge(OdometryResult& result) const {
  const ReckonedStep step = dead_reckoning.step(last.t_ns, result.t_ns, twist_per_s);
  result.status = Tracking::bridged;
  result.reference_keyframe = last.keyframe;
  result.T_reference_left = last.T_keyframe_left * step.T_from_to;
  result.covariance = compose_covariance(last.covariance, step.T_from_to, step.covariance);
}

bool StereoOdometry::State::wants_keyframe(const OdometryResult& result) const {
  if (result.stereo_points < options.motion.min_inliers) return false;
  if (result.status == Tracking::bridged || options.method == OdometryMethod::pnp) return true;
  return result.T_reference_left.translation().norm() > options.keyframe_max_distance_m ||
         rotation_angle(result.T_reference_left) > options.keyframe_max_rotation_deg * kRadPerDeg ||
         result.inliers < options.keyframe_min_overlap * keyframe.most_inliers;
}

void StereoOdometry::State::add_keyframe(OdometryResult& result) {
  if (result.status == Tracking::bridged && !before_loss) before_loss = Anchor{keyframe, last, window};
  if (options.method == OdometryMethod::window) adjust_window(result);
  result.is_keyframe = true;
  result.keyframe = keyframes++;
  keyframe = {.index = result.keyframe, .t_ns = result.t_ns, .view = current};
  if (result.status != Tracking::bridged) last = view_of(keyframe);
}

/// Lets the window refine the step from the last keyframe to this one, and the calibration.
void StereoOdometry::State::adjust_window(OdometryResult& result) {
  if (result.status != Tracking::tracked) {
    window.restart(current);
    return;
  }
  vergence = after_path(vergence, options.self_calibration, result.T_reference_left.translation().norm());
  if (const std::optional<Motion> refined = window.add(calibrated, current, result.T_reference_left, vergence)) {
    const Motion motion = with_support(*refined, keyframe.t_ns, result.t_ns);
    result.T_reference_left = motion.T_a_b;
    result.covariance = motion.covariance;
  }
  if (!plausible(vergence, options.self_calibration)) vergence = {};  // from here on the calibration is believed
  calibrated.vergence_rad = vergence.rad;
}

std::shared_ptr<const StereoFeatures> StereoOdometry::State::without_vergence(
    std::shared_ptr<const StereoFeatures> features) const {
  if (vergence.rad == 0.0) return features;
  auto parallel = std::make_shared<StereoFeatures>(*features);
  const auto added_px = static_cast<float>(calibrated.vergence_px());
  for (float& disparity_px : parallel->disparity_px) {
    if (disparity_px > 0.0F) disparity_px = std::max(kLeastDisparityPx, disparity_px - added_px);
  }
  return parallel;
}

template <class Archive>
void StereoOdometry::State::archive(Archive& io) {
  io(keyframes, keyframe, last, last_usable_ns, twist_per_s, window, vergence.rad, vergence.variance_rad2);
  calibrated.vergence_rad = vergence.rad;
  bool lost = before_loss.has_value();
  io(lost);
  if (lost && !before_loss) before_loss.emplace(Anchor{.window = window});
  if (lost) io(*before_loss);
}

/// Every frame is looked at once, however many views share it.
void StereoOdometry::State::restore_views(const PairSource& pair_at) {
  std::map<TimestampNs, StereoView> seen;
  const auto restore = [&](StereoView& view) {
    if (!seen.contains(view.t_ns)) {
      const auto nothing = std::make_shared<StereoFeatures>();
      seen[view.t_ns] =
          view.left ? observe(view.t_ns, pair_at(view.t_ns)).view : StereoView{.features = nothing, .t_ns = view.t_ns};
    }
    view = seen.at(view.t_ns);
  };
  restore(keyframe.view);
  restore(last.view);
  window.for_each_view(restore);
  if (!before_loss) return;
  restore(before_loss->keyframe.view);
  restore(before_loss->last.view);
  before_loss->window.for_each_view(restore);
}

StereoOdometry::StereoOdometry(const RectifiedRig& rig, Frontend frontend, const OdometryOptions& options)
    : state_(std::make_unique<State>(rig, std::move(frontend), options)) {}

StereoOdometry::~StereoOdometry() = default;

Observation StereoOdometry::observe(TimestampNs t_ns, Image left, Image right) const {
  return state_->observe(t_ns, {std::move(left), std::move(right)});
}

OdometryResult StereoOdometry::process(Observation observation) {
  State& state = *state_;
  OdometryResult result{.t_ns = observation.view.t_ns, .features = std::make_shared<StereoFeatures>()};
  state.look_at(std::move(observation), result);
  if (state.keyframes == 0) {
    state.add_keyframe(result);
    return result;
  }
  const Stopwatch motion;
  const bool tracked = result.reason.empty() && state.track(result);
  if (tracked) {
    state.accept(result);
  } else {
    state.bridge(result);
  }
  if (state.wants_keyframe(result)) state.add_keyframe(result);
  result.features = state.without_vergence(result.features);
  result.vergence = state.vergence;
  result.timings.motion_ms = motion.elapsed_ms();
  return result;
}

void StereoOdometry::set_sensors(MotionSensors sensors) { state_->dead_reckoning.set_sensors(std::move(sensors)); }

std::string StereoOdometry::save() const {
  ArchiveWriter io;
  state_->archive(io);
  return io.take();
}

void StereoOdometry::restore(std::string_view saved, const PairSource& pair_at) {
  ArchiveReader io(saved);
  state_->archive(io);
  state_->restore_views(pair_at);
  if (!state_->last_usable_ns) return;
  ImagePair pair = pair_at(*state_->last_usable_ns);
  state_->frozen_check.remember(std::make_shared<Image>(std::move(pair.left)),
                                std::make_shared<Image>(std::move(pair.right)));
}

std::shared_ptr<const StereoFeatures> StereoOdometry::keyframe_features() const {
  return state_->without_vergence(state_->keyframe.view.features);
}

Matcher& StereoOdometry::matcher() { return *state_->frontend.matcher; }
const Vergence& StereoOdometry::vergence() const { return state_->vergence; }
const RectifiedRig& StereoOdometry::rig() const { return state_->rig; }

}  // namespace demslam

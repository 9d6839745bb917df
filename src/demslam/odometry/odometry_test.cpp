#include "demslam/odometry/odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/geometry/angle.h"
#include "demslam/odometry/synthetic_scene.h"

namespace demslam {
namespace {

using testing_scene::render_pair;
using testing_scene::RenderedPair;
using testing_scene::T_world_left;
using testing_scene::test_rig;

constexpr TimestampNs kStepNs = 100'000'000;

/// A drive over the plane at 0.6 m/s, in a bend.
Pose truth(int frame) {
  const double heading = 0.01 * frame;
  return T_world_left(3.0 * (1.0 - std::cos(heading)), 6.0 * std::sin(heading), heading);
}

RenderedPair frame_of(int frame) { return render_pair(test_rig(), truth(frame), 100 + frame); }

FrontendOptions few_features() {
  FrontendOptions options;
  options.max_features = 500;
  return options;
}

/// Runs frames through an odometry and places every result in the first frame.
class Drive {
 public:
  explicit Drive(OdometryOptions options = {}, const RectifiedRig& rig = test_rig(),
                 Frontend frontend = make_frontend(few_features()))
      : odometry_(rig, std::move(frontend), options) {}

  void set_sensors(MotionSensors sensors) { odometry_.set_sensors(std::move(sensors)); }

  const OdometryResult& feed(int frame, const RenderedPair& pair) {
    results_.push_back(odometry_.process(frame * kStepNs, pair.left, pair.right));
    const OdometryResult& result = results_.back();
    const Pose T_first_left =
        keyframes_.empty() ? Pose() : keyframes_.at(result.reference_keyframe) * result.T_reference_left;
    if (result.is_keyframe) keyframes_.push_back(T_first_left);
    poses_.push_back(T_first_left);
    frames_.push_back(frame);
    return result;
  }
  const OdometryResult& feed(int frame) { return feed(frame, frame_of(frame)); }

  /// Of the last frame, metres.
  double position_error() const {
    const Pose T_first_last = truth(frames_.front()).inverse() * truth(frames_.back());
    return (T_first_last.translation() - poses_.back().translation()).norm();
  }
  const std::vector<OdometryResult>& results() const { return results_; }
  const std::vector<Pose>& poses() const { return poses_; }

 private:
  StereoOdometry odometry_;
  std::vector<OdometryResult> results_;
  std::vector<Pose> keyframes_, poses_;
  std::vector<int> frames_;
};

double sigma_m(const OdometryResult& result) { return std::sqrt(result.covariance.diagonal().tail<3>().sum()); }

TEST(StereoOdometry, FollowsABendToHalfAPerCent) {
  OdometryOptions options;
  options.keyframe_max_distance_m = 0.3;
  Drive drive(options);
  for (int i = 0; i < 25; ++i) drive.feed(i);
  EXPECT_EQ(drive.results().front().status, Tracking::initialised);
  EXPECT_TRUE(drive.results().front().is_keyframe);
  int keyframes = 0;
  for (const OdometryResult& result : drive.results()) {
    EXPECT_NE(result.status, Tracking::bridged) << result.reason;
    keyframes += result.is_keyframe ? 1 : 0;
  }
  EXPECT_GE(keyframes, 4);
  EXPECT_LT(keyframes, 12);
  EXPECT_LT(drive.position_error(), 0.005 * 1.5);
}

TEST(StereoOdometry, FollowsStepsOfSeventyCentimetres) {
  Drive drive;
  for (int frame = 0; frame <= 96; frame += 12) {
    EXPECT_NE(drive.feed(frame).status, Tracking::bridged) << frame << ": " << drive.results().back().reason;
  }
  EXPECT_LT(drive.position_error(), 0.01 * 0.06 * 96);
}

TEST(StereoOdometry, GoesFromFrameToFrameByPnp) {
  OdometryOptions options;
  options.method = OdometryMethod::pnp;
  Drive drive(options);
  for (int i = 0; i < 5; ++i) {
    const OdometryResult& result = drive.feed(i);
    EXPECT_TRUE(result.is_keyframe);
    if (i > 0) {
      EXPECT_EQ(result.reference_keyframe, static_cast<std::size_t>(i - 1));
    }
  }
  EXPECT_LT(drive.position_error(), 0.03);
}

/// Of a right camera that has turned about its y axis since its calibration.
RenderedPair frame_of_a_turned_rig(int frame, double vergence_rad) {
  const RectifiedRig rig = test_rig();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(vergence_rad, Eigen::Vector3d::UnitY()));
  const Pose T_world_right = truth(frame) * Pose(turn, {rig.baseline_m, 0.0, 0.0});
  return {frame_of(frame).left, testing_scene::render(rig, T_world_right, 1000 + frame)};
}

TEST(StereoOdometry, FindsThatTheCamerasHaveTurnedAgainstEachOther) {
  const double vergence_rad = 0.03 * kRadPerDeg;
  OdometryOptions options;
  options.keyframe_max_distance_m = 0.3;
  Drive drive(options);
  options.self_calibration.enabled = false;
  Drive trusting(options);
  for (int i = 0; i < 40; ++i) {
    const RenderedPair pair = frame_of_a_turned_rig(i, vergence_rad);
    drive.feed(i, pair);
    trusting.feed(i, pair);
  }
  const OdometryResult& last = drive.results().back();
  EXPECT_NEAR(last.vergence.rad, vergence_rad, 3.0 * last.vergence.sigma_rad());
  EXPECT_LT(last.vergence.sigma_rad(), 0.3 * vergence_rad);
  EXPECT_LT(drive.position_error(), 0.7 * trusting.position_error());
  EXPECT_EQ(trusting.results().back().vergence.rad, 0.0);
  // What the map is given is as of parallel cameras.
  const StereoFeatures &parallel = *last.features, &raw = *trusting.results().back().features;
  RectifiedRig turned = test_rig();
  turned.vergence_rad = last.vergence.rad;
  for (std::size_t i = 0; i < raw.left.size(); ++i) {
    if (raw.disparity_px[i] < 1.0F) continue;
    EXPECT_NEAR(raw.disparity_px[i] - parallel.disparity_px[i], turned.vergence_px(), 1e-4);
  }
}

TEST(StereoOdometry, ClaimsNoCalibrationWithoutAWindow) {
  OdometryOptions options;
  options.method = OdometryMethod::keyframe;
  Drive by_keyframes(options);
  options.method = OdometryMethod::window;
  Drive by_window(options);
  for (int i = 0; i < 2; ++i) {
    by_keyframes.feed(i);
    by_window.feed(i);
  }
  EXPECT_EQ(by_keyframes.results().back().vergence.variance_rad2, 0.0);
  EXPECT_GT(by_window.results().back().vergence.variance_rad2, 0.0);
}

TEST(OdometryMethod, HasAWordForEach) {
  for (const OdometryMethod method : {OdometryMethod::pnp, OdometryMethod::keyframe, OdometryMethod::window}) {
    EXPECT_EQ(odometry_method(to_string(method)), method);
  }
  EXPECT_FALSE(odometry_method("frame"));
}

TEST(StereoOdometry, ErrorsFitTheClaimedCovariance) {
  Drive drive;
  for (int i = 0; i < 8; ++i) drive.feed(i);
  for (int i = 1; i < 8; ++i) {
    const Vector6d error = ((truth(0).inverse() * truth(i)).inverse() * drive.poses()[i]).log();
    const Matrix6d& covariance = drive.results()[i].covariance;
    EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 40.0) << i;  // six degrees of freedom
    EXPECT_LT(sigma_m(drive.results()[i]), 0.01);
  }
}

/// So narrow that all it sees of the plane is far, on a rover that drives along the plane.
RectifiedRig narrow_rig() {
  RectifiedRig rig = test_rig();
  rig.baseline_m = 0.002;
  rig.T_body_left = Pose(rotation_from_rpy(0.0, 0.6, 0.0) * R_body_camera_level(), Eigen::Vector3d::Zero());
  return rig;
}

MotionSensors straight_on(double m_per_s, TimestampNs duration_ns) {
  MotionSensors sensors;
  for (TimestampNs t = 0; t <= duration_ns; t += kStepNs / 10) {
    const double rolled_m = m_per_s * to_seconds(t);
    sensors.imu.push_back({t});
    sensors.wheels.push_back({t, rolled_m, rolled_m});
  }
  return sensors;
}

TEST(StereoOdometry, FarPointsAloneLeaveTheDistanceToTheWheels) {
  constexpr double kStep_m = 0.2;
  constexpr int kFrames = 10;
  const RectifiedRig rig = narrow_rig();
  std::map<bool, double> worst_m, sigma;
  for (const bool support : {false, true}) {
    OdometryOptions options;
    options.lost.support_weak = support;
    Drive drive(options, rig);
    drive.set_sensors(straight_on(kStep_m / to_seconds(kStepNs), kFrames * kStepNs));
    for (int i = 0; i <= kFrames; ++i) {
      const OdometryResult& result = drive.feed(i, render_pair(rig, T_world_left(0.0, i * kStep_m, 0.0), 300 + i));
      EXPECT_NE(result.status, Tracking::bridged) << result.reason;
      worst_m[support] = std::max(worst_m[support], std::abs(drive.poses().back().translation().norm() - i * kStep_m));
      sigma[support] = std::max(sigma[support], sigma_m(result));
    }
  }
  EXPECT_GT(sigma[false], 0.1);
  EXPECT_LT(sigma[true], 0.05);  // of two steps; the wheels claim 5 % of each
  EXPECT_LT(worst_m[true], 0.05);
  EXPECT_LT(worst_m[true], 0.5 * worst_m[false]);
}

TEST(StereoOdometry, SameInputGivesTheSameBytes) {
  Drive once, again;
  for (int i = 0; i < 5; ++i) {
    const OdometryResult& a = once.feed(i);
    const OdometryResult& b = again.feed(i);
    EXPECT_EQ(a.T_reference_left.matrix(), b.T_reference_left.matrix());
    EXPECT_EQ(a.covariance, b.covariance);
    EXPECT_EQ(a.inliers, b.inliers);
  }
}

/// A scene of stray frames in the middle, so that the state includes what to come back to.
RenderedPair frame_with_a_stray(int frame) {
  return frame == 4 ? render_pair(test_rig(), T_world_left(70.0, 40.0, 1.0), 7) : frame_of(frame);
}

TEST(StereoOdometry, GoesOnFromASavedStateToTheSameBits) {
  OdometryOptions options;
  options.keyframe_max_distance_m = 0.1;
  const auto pair_at = [](TimestampNs t_ns) {
    const RenderedPair pair = frame_with_a_stray(static_cast<int>(t_ns / kStepNs));
    return ImagePair{pair.left, pair.right};
  };
  const auto process = [&](StereoOdometry& odometry, int frame) {
    const ImagePair pair = pair_at(frame * kStepNs);
    return odometry.process(frame * kStepNs, pair.left, pair.right);
  };
  StereoOdometry undisturbed(test_rig(), make_frontend(few_features()), options);
  for (int i = 0; i < 5; ++i) process(undisturbed, i);
  StereoOdometry restored(test_rig(), make_frontend(few_features()), options);
  restored.restore(undisturbed.save(), pair_at);
  EXPECT_EQ(restored.save(), undisturbed.save());
  for (int i = 5; i < 8; ++i) {
    const OdometryResult a = process(undisturbed, i), b = process(restored, i);
    EXPECT_EQ(a.status, Tracking::tracked) << a.reason;
    EXPECT_EQ(a.T_reference_left.matrix(), b.T_reference_left.matrix());
    EXPECT_EQ(a.covariance, b.covariance);
    EXPECT_EQ(a.keyframe, b.keyframe);
  }
  EXPECT_EQ(restored.save(), undisturbed.save());
}

TEST(StereoOdometry, RefusesASavedStateThatIsCutShort) {
  StereoOdometry odometry(test_rig(), make_frontend(few_features()), {});
  const std::string saved = odometry.save();
  EXPECT_THROW(odometry.restore(saved.substr(0, saved.size() / 2), {}), Error);
}

TEST(StereoOdometry, BridgesDarkFramesAndComesBackToItsKeyframe) {
  Drive drive;
  for (int i = 0; i < 5; ++i) drive.feed(i);
  const RenderedPair dark{Image(320, 240, 3), Image(320, 240, 3)};
  double last_sigma = sigma_m(drive.results().back());
  for (int i = 5; i < 8; ++i) {
    const OdometryResult& result = drive.feed(i, dark);
    EXPECT_EQ(result.status, Tracking::bridged);
    EXPECT_EQ(result.reason, "dark frame");
    EXPECT_FALSE(result.is_keyframe);
    EXPECT_LT(drive.position_error(), 0.03);  // constant velocity in a gentle bend
    EXPECT_GT(sigma_m(result), last_sigma + 0.04);
    last_sigma = sigma_m(result);
  }
  const OdometryResult& back = drive.feed(8);
  EXPECT_EQ(back.status, Tracking::tracked);
  EXPECT_EQ(back.reference_keyframe, 0U);
  EXPECT_LT(drive.position_error(), 0.005);
}

TEST(StereoOdometry, NamesWhatIsWrongWithAFrame) {
  Drive drive;
  drive.feed(0);
  const RenderedPair frame = frame_of(1);
  drive.feed(1, frame);
  EXPECT_EQ(drive.feed(2, frame).reason, "frozen frame");
  EXPECT_EQ(drive.feed(3, {Image(320, 240, 255), Image(320, 240, 255)}).reason, "saturated frame");
  EXPECT_EQ(drive.feed(4, {Image(), Image()}).reason, "empty frame");
  EXPECT_EQ(drive.feed(5, {Image(32, 24, 90), Image(32, 24, 90)}).reason, "frame of another size");
  for (const OdometryResult& result : drive.results()) ASSERT_TRUE(result.features);
  EXPECT_EQ(drive.feed(6).status, Tracking::tracked);
}

struct BlindMatcher : Matcher {
  std::vector<Match> match(const Features&, const Features&) override { return {}; }
};

TEST(StereoOdometry, FindsASuddenTurnThatItsMatcherDoesNotSee) {
  Frontend frontend = make_frontend(few_features());
  frontend.matcher = std::make_unique<BlindMatcher>();
  Drive drive({}, test_rig(), std::move(frontend));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(drive.feed(i).reason, "");
  const Pose turned = truth(2) * Pose(rotation_from_rpy(0.0, 0.3, 0.0), Eigen::Vector3d(0.0, 0.0, 0.06));
  const OdometryResult& turn = drive.feed(3, render_pair(test_rig(), turned, 7));
  EXPECT_EQ(turn.status, Tracking::tracked) << turn.reason;
  const Pose T_first_turned = truth(0).inverse() * turned;
  EXPECT_LT((T_first_turned.inverse() * drive.poses().back()).log().norm(), 0.05);
}

TEST(StereoOdometry, RefusesAJump) {
  OdometryOptions options;
  options.max_speed_m_per_s = 1.0;
  Drive drive(options);
  for (int i = 0; i < 3; ++i) drive.feed(i);
  const OdometryResult& jump = drive.feed(3, frame_of(9));  // 0.36 m in 0.1 s
  EXPECT_EQ(jump.status, Tracking::bridged);
  EXPECT_EQ(jump.reason, "jump");
}

TEST(StereoOdometry, ReturnsToTheOldKeyframeAfterAStrayFrame) {
  Drive drive;
  for (int i = 0; i < 4; ++i) drive.feed(i);
  const OdometryResult& stray = drive.feed(4, render_pair(test_rig(), T_world_left(70.0, 40.0, 1.0), 7));
  EXPECT_EQ(stray.status, Tracking::bridged);
  EXPECT_TRUE(stray.is_keyframe);
  const OdometryResult& back = drive.feed(5);
  EXPECT_EQ(back.status, Tracking::tracked);
  EXPECT_EQ(back.reference_keyframe, 0U);
  EXPECT_LT(drive.position_error(), 0.005);
}

TEST(StereoOdometry, GoesOnFromANewKeyframeWhereTheOldOneIsOutOfSight) {
  Drive drive;
  for (int i = 0; i < 3; ++i) drive.feed(i);
  const auto far_away = [](int i) { return render_pair(test_rig(), T_world_left(70.0, 40.0 + 0.06 * i, 1.0), 7 + i); };
  EXPECT_EQ(drive.feed(3, far_away(3)).status, Tracking::bridged);
  for (int i = 4; i < 7; ++i) {
    const OdometryResult& result = drive.feed(i, far_away(i));
    EXPECT_EQ(result.status, Tracking::tracked) << result.reason;
    EXPECT_EQ(result.reference_keyframe, 1U);
  }
}

TEST(StereoOdometry, StartsEvenOnABadFrame) {
  Drive drive;
  const OdometryResult& first = drive.feed(0, {Image(320, 240, 0), Image(320, 240, 0)});
  EXPECT_TRUE(first.is_keyframe);
  EXPECT_EQ(first.reason, "dark frame");
  EXPECT_TRUE(drive.feed(1).is_keyframe);
  EXPECT_EQ(drive.feed(2).status, Tracking::tracked);
}

TEST(EstimateMotion, SaysWhyItFailed) {
  const Motion none = estimate_motion(test_rig(), std::vector<Correspondence>{}, {});
  EXPECT_FALSE(none.ok);
  EXPECT_EQ(none.reason, "too few matches (0)");
}

}  // namespace
}  // namespace demslam

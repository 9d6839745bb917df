#include "demslam/store/map_check.h"

#include <cmath>
#include <format>
#include <functional>

#include "demslam/base/error.h"
#include "demslam/store/map_store.h"
#include "demslam/store/schema.h"

namespace demslam {
namespace {

constexpr double kUnitTolerance = 1e-9;

bool is_sound(const Pose& pose) {
  return pose.translation().allFinite() && std::abs(pose.rotation().norm() - 1.0) < kUnitTolerance;
}

bool is_sound(const Matrix6d& covariance) {
  return covariance.allFinite() && (covariance.diagonal().array() >= 0.0).all();
}

class Checker {
 public:
  explicit Checker(const std::filesystem::path& file)
      : database_(open_map_file(file, OpenMode::read)), store_(MapStore::open_read_only(file)) {}

  MapReport run() {
    guarded("file", [&] { check_file(); });
    guarded("keyframes", [&] { check_keyframes(); });
    guarded("factors", [&] { check_factors(); });
    guarded("frames", [&] { check_frames(); });
    guarded("estimates", [&] { check_estimates(); });
    for (std::size_t k = 0; k < report_.keyframes; ++k) {
      guarded(std::format("features of keyframe {}", k), [&] { check_features(k); });
    }
    return report_;
  }

 private:
  void problem(std::string text) { report_.problems.push_back(std::move(text)); }

  void expect(bool sound, const char* what, std::size_t index, const char* finding) {
    if (!sound) problem(std::format("{} {}: {}", what, index, finding));
  }

  /// Damage that stops a reading is one problem of what was read.
  void guarded(const std::string& what, const std::function<void()>& check) {
    try {
      check();
    } catch (const Error& error) {
      problem(what + ": " + error.what());
    }
  }

  void check_file() {
    for (Statement findings = database_.prepare("PRAGMA integrity_check"); findings.step();) {
      if (findings.bytes(0) != "ok") problem("file: " + findings.string(0));
    }
    for (Statement dangling = database_.prepare("PRAGMA foreign_key_check"); dangling.step();) {
      problem(std::format("{} {}: refers to nothing in {}", dangling.bytes(0), dangling.integer(1), dangling.bytes(2)));
    }
    if (store_.header().rig.baseline_m <= 0.0) problem("meta: the calibration has no baseline");
  }

  void check_keyframes() {
    std::int64_t last_frame = -1;
    for (const StoredKeyframe& keyframe : store_.keyframes()) {
      const std::size_t index = report_.keyframes++;
      expect(keyframe.index == index, "keyframe", index, "is missing");
      expect(static_cast<std::int64_t>(keyframe.frame) > last_frame, "keyframe", index, "is out of order");
      expect(is_sound(keyframe.T_map_body) && is_sound(keyframe.T_map_body_odometry), "keyframe", index,
             "pose is broken");
      last_frame = static_cast<std::int64_t>(keyframe.frame);
    }
    check_checkpoint();
  }

  void check_checkpoint() {
    if (report_.keyframes == 0) return;
    const std::int64_t keyframe = database_.integer("SELECT coalesce(max(keyframe), -1) FROM checkpoint");
    if (keyframe + 1 != static_cast<std::int64_t>(report_.keyframes)) {
      problem(std::format("checkpoint: is of keyframe {}, not of the last one", keyframe));
    }
  }

  void check_factors() {
    std::vector<bool> tied(report_.keyframes, false);
    if (!tied.empty()) tied[0] = true;
    for (const StoredFactor& factor : store_.factors()) {
      const std::size_t index = report_.factors++;
      const RelativePose& m = factor.measurement;
      expect(is_sound(m.T_i_j) && is_sound(m.covariance), "factor", index, "measurement is broken");
      expect(m.i != m.j, "factor", index, "ties a keyframe to itself");
      if (factor.kind == FactorKind::odometry && m.j < tied.size()) tied[m.j] = true;
    }
    for (std::size_t k = 0; k < tied.size(); ++k) expect(tied[k], "keyframe", k, "has no odometry");
  }

  void check_frames() {
    store_.for_each_frame([&](const StoredFrame& frame) {
      ++report_.frames;
      expect(is_sound(frame.T_keyframe_body), "frame", frame.index, "pose is broken");
    });
    for (Statement lost = database_.prepare("SELECT id FROM keyframes WHERE frame NOT IN (SELECT id FROM frames)");
         lost.step();) {
      expect(false, "keyframe", lost.index(0), "has lost its frame");
    }
  }

  void check_estimates() {
    const std::vector<StoredEstimate> estimates = store_.estimates();
    if (estimates.size() != report_.keyframes)
      problem(std::format("estimates: {} of {} keyframes", estimates.size(), report_.keyframes));
    for (const StoredEstimate& estimate : estimates) {
      const bool sound = is_sound(estimate.T_map_body) && (!estimate.covariance || is_sound(*estimate.covariance));
      expect(sound, "estimate", estimate.keyframe, "is broken");
    }
  }

  void check_features(std::size_t keyframe) {
    const auto features = store_.features(keyframe);
    bool finite = features->left.descriptors.allFinite();
    for (std::size_t i = 0; i < features->left.size(); ++i) {
      finite = finite && features->left.keypoints[i].allFinite() && std::isfinite(features->disparity_px[i]);
    }
    expect(finite, "keyframe", keyframe, "features are not finite");
  }

  Database database_;
  MapStore store_;
  MapReport report_;
};

}  // namespace

MapReport check_map(const std::filesystem::path& file) { return Checker(file).run(); }

}  // namespace demslam

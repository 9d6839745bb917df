#include "demslam/slam/recorder.h"

#include <format>

#include "demslam/base/error.h"
#include "demslam/odometry/archive.h"
#include "demslam/slam/frame_json.h"

namespace demslam {
namespace {

constexpr double kSamePosition_m = 1e-6;

StoredFrame stored(const FrameRecord& record) {
  const FramePlace& place = record.place;
  return {record.index,          place.t_ns,        to_string(record.odometry.status), place.keyframe,
          place.T_keyframe_body, frame_json(record)};
}

StoredFactor stored(const LoopResult& loop) {
  return {FactorKind::loop, loop.measurement, to_string(loop.status), loop.chi_square, loop.inliers};
}

std::string payload_of(const FrameRecord& record) {
  ArchiveWriter io;
  io(record.odometry, record.keyframe->verified);
  return io.take();
}

RecordedKeyframe recorded(const StoredKeyframe& keyframe) {
  RecordedKeyframe result;
  ArchiveReader io(keyframe.payload);
  io(result.odometry, result.verified);
  return result;
}

Tracking tracking_of(const std::string& status) {
  for (const Tracking tracking : {Tracking::initialised, Tracking::tracked}) {
    if (status == to_string(tracking)) return tracking;
  }
  return Tracking::bridged;
}

void check_same_estimates(const Backend& backend, const MapStore& map) {
  for (const StoredEstimate& estimate : map.estimates()) {
    const Pose repeated = backend.T_map_keyframe(estimate.keyframe);
    const double difference_m = (repeated.translation() - estimate.T_map_body.translation()).norm();
    if (difference_m > kSamePosition_m) {
      throw Error(
          std::format("keyframe {} comes out {:.2g} m from where it was: the run was made on another machine or "
                      "by another build; go on there, or start anew with --overwrite",
                      estimate.keyframe, difference_m));
    }
  }
}

void check_same_images(const StereoFeatures& seen, const StereoFeatures& stored) {
  if (seen.left.keypoints != stored.left.keypoints || seen.disparity_px != stored.disparity_px) {
    throw Error("the images are not those that the run began with; start anew with --overwrite");
  }
}

}  // namespace

Recorder::Recorder(MapStore& map, Slam& slam) : map_(map), slam_(slam) {
  for (std::size_t k = 0; k < slam.backend().keyframes(); ++k) written_.push_back(slam.backend().T_map_keyframe(k));
  for (const StoredFactor& factor : map.factors()) {
    if (factor.kind == FactorKind::loop) loop_factors_[{factor.measurement.i, factor.measurement.j}] = factors_;
    ++factors_;
  }
}

/// Compared with what is written, so that it does not matter who moved them.
std::vector<std::pair<std::size_t, Pose>> Recorder::moved_keyframes() {
  std::vector<std::pair<std::size_t, Pose>> moved;
  for (std::size_t k = 0; k < written_.size(); ++k) {
    const Pose now = slam_.backend().T_map_keyframe(k);
    if (now.translation() == written_[k].translation() && now.rotation().coeffs() == written_[k].rotation().coeffs())
      continue;
    moved.emplace_back(k, now);
    written_[k] = now;
  }
  return moved;
}

/// A loop of this keyframe, or a change of mind about an earlier one.
void Recorder::store_loop(const LoopResult& loop, std::size_t keyframe, KeyframeEntry& entry) {
  const std::pair between{loop.measurement.i, loop.measurement.j};
  const auto known = loop_factors_.find(between);
  if (loop.measurement.j == keyframe || known == loop_factors_.end()) {
    loop_factors_[between] = factors_ + entry.factors.size();
    entry.factors.push_back(stored(loop));
  } else {
    entry.factor_statuses.push_back({known->second, to_string(loop.status)});
  }
}

void Recorder::add(const FrameRecord& record) {
  frames_.push_back(stored(record));
  if (!record.keyframe) return;
  const Backend& backend = slam_.backend();
  const std::size_t k = record.odometry.keyframe;
  const Pose T_map_body = backend.T_map_keyframe(k);
  KeyframeEntry entry{.keyframe = {k, record.index, record.odometry.t_ns, T_map_body,
                                   backend.T_map_keyframe_odometry(k), payload_of(record)},
                      .features = record.odometry.features,
                      .frames = std::move(frames_),
                      .checkpoint = slam_.odometry().save()};
  if (record.keyframe->odometry) {
    entry.factors.push_back({.measurement = *record.keyframe->odometry, .inliers = record.odometry.inliers});
  }
  for (const LoopResult& loop : record.keyframe->loops) store_loop(loop, k, entry);
  factors_ += entry.factors.size();
  if (record.optimized) entry.T_map_body = moved_keyframes();
  map_.append(entry);
  frames_.clear();
  written_.push_back(T_map_body);
}

void Recorder::finish(const SlamResult& result) {
  map_.append_frames(frames_);
  frames_.clear();
  std::vector<StoredEstimate> estimates;
  for (std::size_t k = 0; k < result.keyframes.size(); ++k) {
    estimates.push_back({k, result.keyframes[k].T_map_body, result.keyframes[k].covariance});
  }
  map_.set_final_estimates(estimates);
}

void for_each_recorded_frame(const MapStore& map, const FrameVisitor& visit_frame,
                             const KeyframeVisitor& visit_keyframe) {
  const std::size_t keyframes = map.keyframe_count();
  if (keyframes == 0) return;
  StoredKeyframe keyframe = map.keyframe(0);
  map.for_each_frame([&](const StoredFrame& frame) {
    if (frame.index != keyframe.frame) {
      visit_frame(frame, {frame.t_ns, frame.keyframe, frame.T_keyframe_body}, tracking_of(frame.status));
      return;
    }
    visit_keyframe(frame, recorded(keyframe));
    if (keyframe.index + 1 < keyframes) keyframe = map.keyframe(keyframe.index + 1);
  });
}

void resume(Slam& slam, MapStore& map, const PairSource& pair_at) {
  map.rewind();
  const std::size_t keyframes = map.keyframe_count();
  if (keyframes == 0) return;
  Backend& backend = slam.backend();
  for_each_recorded_frame(
      map, [&](const StoredFrame&, const FramePlace& place, Tracking status) { backend.repeat(place, status); },
      [&](const StoredFrame&, RecordedKeyframe keyframe) {
        backend.repeat(keyframe.odometry, std::move(keyframe.verified));
      });
  check_same_estimates(slam.backend(), map);
  slam.odometry().restore(map.checkpoint(), pair_at);
  check_same_images(*slam.odometry().keyframe_features(), *map.features(keyframes - 1));
}

}  // namespace demslam

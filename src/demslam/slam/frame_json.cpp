#include "demslam/slam/frame_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

Json loop_json(const LoopResult& loop) {
  Json json = {{"status", to_string(loop.status)}, {"inliers", loop.inliers}};
  if (loop.status != LoopStatus::not_matched) json["keyframe"] = loop.measurement.i;
  if (!loop.reason.empty()) json["reason"] = loop.reason;
  return json;
}

}  // namespace

std::string to_string(LoopStatus status) {
  switch (status) {
    case LoopStatus::accepted:
      return "accepted";
    case LoopStatus::not_matched:
      return "not matched";
    case LoopStatus::inconsistent:
      return "inconsistent";
    case LoopStatus::unconfirmed:
      return "unconfirmed";
    case LoopStatus::rejected:
      return "rejected";
    case LoopStatus::switched_off:
      return "switched off";
  }
  return "";
}

std::string frame_json(const FrameRecord& record) {
  const OdometryResult& odometry = record.odometry;
  const auto& p = record.T_map_body.translation();
  Json json = {{"frame", record.index},
               {"t_ns", odometry.t_ns},
               {"status", to_string(odometry.status)},
               {"keypoints", odometry.keypoints},
               {"stereo_points", odometry.stereo_points},
               {"matches", odometry.matches},
               {"inliers", odometry.inliers},
               {"rms_px", odometry.rms_px},
               {"position_m", {p.x(), p.y(), p.z()}}};
  if (!odometry.reason.empty()) json["reason"] = odometry.reason;
  if (odometry.status == Tracking::bridged)
    json["sigma_m"] = std::sqrt(odometry.covariance.diagonal().tail<3>().mean());
  if (odometry.is_keyframe) json["keyframe"] = odometry.keyframe;
  if (odometry.is_keyframe && odometry.vergence.variance_rad2 > 0.0) {
    json["vergence_deg"] = odometry.vergence.rad / kRadPerDeg;
    json["vergence_sigma_deg"] = odometry.vergence.sigma_rad() / kRadPerDeg;
  }
  if (record.loop) json["loop"] = loop_json(*record.loop);
  if (record.keyframe && !record.keyframe->earlier_map.empty()) {
    json["earlier_map"] = loop_json(record.keyframe->earlier_map.back());
  }
  if (record.optimized) json["optimized"] = true;
  return json.dump();
}

}  // namespace demslam

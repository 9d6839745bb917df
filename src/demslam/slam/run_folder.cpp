#include "demslam/slam/run_folder.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

std::string tum_text(const Trajectory& trajectory) {
  std::string text = "# timestamp_s tx ty tz qx qy qz qw   (T_map_body)\n";
  for (const auto& [t_ns, pose] : trajectory) {
    const auto& p = pose.translation();
    const auto& q = pose.rotation();
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", seconds_text(t_ns), p.x(), p.y(),
                        p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string covariance_text(const std::vector<KeyframeEstimate>& keyframes) {
  std::string text =
      "# 6x6 covariance of the right perturbation of T_map_body (rotation [rad], translation [m]), row-major\nt_ns";
  for (int row = 0; row < 6; ++row) {
    for (int col = 0; col < 6; ++col) text += fmt::format(",c{}{}", row, col);
  }
  text += "\n";
  for (const KeyframeEstimate& keyframe : keyframes) {
    text += std::to_string(keyframe.t_ns);
    for (int row = 0; row < 6; ++row) {
      for (int col = 0; col < 6; ++col) text += fmt::format(",{:.6e}", keyframe.covariance(row, col));
    }
    text += "\n";
  }
  return text;
}

std::string geojson_text(const Trajectory& trajectory, const LocalFrame& frame) {
  const Georeference georeference(frame);
  Json line = Json::array();
  for (const auto& stamped : trajectory) {
    const Eigen::Vector3d p = georeference.lon_lat_height(stamped.pose.translation());
    line.push_back({p.x(), p.y(), p.z()});
  }
  const Json feature = {{"type", "Feature"},
                        {"properties", {{"name", "demslam trajectory"}, {"crs", frame.crs_wkt}}},
                        {"geometry", {{"type", "LineString"}, {"coordinates", line}}}};
  return Json{{"type", "FeatureCollection"}, {"features", {feature}}}.dump(1) + "\n";
}

const char* name_of(LoopStatus status) {
  switch (status) {
    case LoopStatus::accepted:
      return "accepted";
    case LoopStatus::not_matched:
      return "not matched";
    case LoopStatus::inconsistent:
      return "inconsistent";
  }
  return "";
}

Json loop_json(const LoopResult& loop) {
  Json json = {{"status", name_of(loop.status)}, {"inliers", loop.inliers}};
  if (loop.status != LoopStatus::not_matched) json["keyframe"] = loop.measurement.i;
  if (!loop.reason.empty()) json["reason"] = loop.reason;
  return json;
}

std::string record_json(const FrameRecord& record) {
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
  if (odometry.is_keyframe) json["keyframe"] = odometry.keyframe;
  if (record.loop) json["loop"] = loop_json(*record.loop);
  if (record.optimized) json["optimized"] = true;
  return json.dump() + "\n";
}

void check_usable(const std::filesystem::path& path, bool overwrite) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw Error(path.string() + ": cannot create the run folder (" + error.message() + ")");
  if (!overwrite && std::filesystem::exists(path / "summary.json")) {
    throw Error(path.string() + ": already holds a run; choose another folder or pass --overwrite");
  }
}

}  // namespace

void write_file_atomically(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path temporary = file.string() + ".tmp";
  std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(temporary, file, error);
  if (!stream || error) {
    std::filesystem::remove(temporary, error);
    throw Error(file.string() + ": cannot be written (disk full, or the folder is not writable)");
  }
}

RunFolder::RunFolder(const std::filesystem::path& path, bool overwrite) : path_(path) {
  check_usable(path, overwrite);
  std::error_code ignored;
  std::filesystem::remove(path / "summary.json", ignored);
  frames_.open(path / "frames.jsonl", std::ios::binary | std::ios::trunc);
  timings_.open(path / "timings.csv", std::ios::binary | std::ios::trunc);
  timings_ << "frame,extract_ms,stereo_ms,motion_ms,loop_ms,optimize_ms,total_ms\n";
  if (!frames_ || !timings_.flush()) {
    throw Error(path.string() + ": cannot be written (disk full, or the folder is not writable)");
  }
}

void RunFolder::write_config(const std::string& toml) { write_file_atomically(path_ / "config.toml", toml); }

void RunFolder::append(const FrameRecord& record) {
  const OdometryTimings& t = record.odometry.timings;
  frames_ << record_json(record) << std::flush;
  timings_ << fmt::format("{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", record.index, t.extract_ms, t.stereo_ms,
                          t.motion_ms, record.loop_ms, record.optimize_ms, record.total_ms)
           << std::flush;
  if (!frames_ || !timings_) throw Error((path_ / "frames.jsonl").string() + ": cannot be written (disk full?)");
}

void RunFolder::write_result(const SlamResult& result, const LocalFrame* frame) {
  write_file_atomically(path_ / "trajectory.tum", tum_text(result.trajectory));
  write_file_atomically(path_ / "odometry.tum", tum_text(result.odometry));
  write_file_atomically(path_ / "covariance.csv", covariance_text(result.keyframes));
  if (frame != nullptr && !frame->crs_wkt.empty()) {
    write_file_atomically(path_ / "trajectory.geojson", geojson_text(result.trajectory, *frame));
  }
}

void RunFolder::write_summary(const std::string& json) { write_file_atomically(path_ / "summary.json", json); }

}  // namespace demslam

#include "demslam/slam/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/memory.h"
#include "demslam/base/text.h"
#include "demslam/dem/geo_track.h"
#include "demslam/slam/frame_json.h"
#include "demslam/store/writer_lock.h"

namespace demslam {
namespace {

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

std::string residuals_text(const std::vector<FactorResidual>& residuals) {
  std::string text = "kind,keyframe,rows,chi_square\n";
  for (const FactorResidual& r : residuals)
    text += fmt::format("{},{},{},{:.6g}\n", r.kind, r.keyframe, r.rows, r.chi_square);
  return text;
}

std::size_t count_lines(const std::string& text) { return std::ranges::count(text, '\n'); }

/// The header and the first `count` lines of an earlier part of the run, as far as they are there.
std::string kept_timings(const std::filesystem::path& file, std::size_t count) {
  std::string text = "frame,extract_ms,stereo_ms,motion_ms,loop_ms,optimize_ms,store_ms,total_ms,rss_mib\n";
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  for (std::size_t n = 0; n < count && std::getline(stream, line); ++n) text += line + "\n";
  return text;
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

RunFolder::RunFolder(const std::filesystem::path& path) : path_(path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw Error(path.string() + ": cannot create the run folder (" + error.message() + ")");
}

std::optional<std::string> RunFolder::summary() const {
  const std::filesystem::path file = path_ / "summary.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  return read_text(file);
}

void RunFolder::clear() {
  const WriterLock nobody_writes(map_file());
  for (const char* name : {"summary.json", "map.db", "map.db-wal", "map.db-shm", "map.db.new", "frames.jsonl"}) {
    std::error_code error;
    std::filesystem::remove(path_ / name, error);
    if (error) throw Error((path_ / name).string() + ": cannot be removed (" + error.message() + ")");
  }
}

void RunFolder::begin(const std::string& earlier_frames) {
  const std::string earlier_timings = kept_timings(path_ / "timings.csv", count_lines(earlier_frames));
  std::error_code ignored;
  std::filesystem::remove(path_ / "summary.json", ignored);
  frames_.open(path_ / "frames.jsonl", std::ios::binary | std::ios::trunc);
  timings_.open(path_ / "timings.csv", std::ios::binary | std::ios::trunc);
  frames_ << earlier_frames;
  timings_ << earlier_timings;
  if (!frames_.flush() || !timings_.flush()) {
    throw Error(path_.string() + ": cannot be written (disk full, or the folder is not writable)");
  }
}

void RunFolder::write_config(const std::string& toml) { write_file_atomically(path_ / "config.toml", toml); }

void RunFolder::append(const FrameRecord& record) {
  const OdometryTimings& t = record.odometry.timings;
  frames_ << frame_json(record) << "\n" << std::flush;
  timings_ << fmt::format("{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.1f}\n", record.index, t.extract_ms,
                          t.stereo_ms, t.motion_ms, record.loop_ms, record.optimize_ms, record.store_ms,
                          record.total_ms, resident_mib())
           << std::flush;
  if (!frames_ || !timings_) throw Error((path_ / "frames.jsonl").string() + ": cannot be written (disk full?)");
}

void RunFolder::write_result(const SlamResult& result, const LocalFrame* frame) {
  write_file_atomically(path_ / "trajectory.tum", tum_text(result.trajectory));
  write_file_atomically(path_ / "odometry.tum", tum_text(result.odometry));
  write_file_atomically(path_ / "covariance.csv", covariance_text(result.keyframes));
  write_file_atomically(path_ / "residuals.csv", residuals_text(result.residuals));
  if (frame != nullptr && !frame->crs_wkt.empty()) {
    write_file_atomically(path_ / "trajectory.geojson", geojson_track(result.trajectory, *frame, "trajectory"));
  }
}

void RunFolder::write_summary(const std::string& json) { write_file_atomically(path_ / "summary.json", json); }

}  // namespace demslam

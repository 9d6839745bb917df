#include "demslam/report/run_snapshot.h"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/store/map_store.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What a map says of the frames up to its last keyframe.
struct Progressed {
  Trajectory trajectory, odometry;
  std::string records;
  std::size_t frames = 0;
};

Progressed progress_of(const MapStore& map) {
  const std::vector<StoredKeyframe> keyframes = map.keyframes();
  const std::vector<StoredEstimate> estimates = map.estimates();
  Progressed progress;
  map.for_each_frame([&](const StoredFrame& frame) {
    ++progress.frames;
    progress.records += frame.record + "\n";
    if (frame.status == "bridged" || frame.keyframe >= std::min(keyframes.size(), estimates.size())) return;
    progress.trajectory.push_back({frame.t_ns, estimates[frame.keyframe].T_map_body * frame.T_keyframe_body});
    progress.odometry.push_back({frame.t_ns, keyframes[frame.keyframe].T_map_body_odometry * frame.T_keyframe_body});
  });
  return progress;
}

std::size_t accepted_loops(const MapStore& map) {
  return std::ranges::count_if(map.factors(), [](const StoredFactor& factor) {
    return factor.kind == FactorKind::loop && factor.status == "accepted";
  });
}

/// As far as it is known before the run's end.
std::string summary_of(const MapStore& map, const Progressed& progress) {
  const MapHeader header = map.header();
  const Json json = {{"demslam", header.version},
                     {"inputs", Json::parse(header.inputs)},
                     {"running", true},
                     {"counters",
                      {{"frames", progress.frames},
                       {"tracked", progress.trajectory.size()},
                       {"keyframes", map.keyframe_count()},
                       {"loops", {{"accepted", accepted_loops(map)}}}}},
                     {"path_length_m", path_length_m(progress.trajectory)}};
  return json.dump(1) + "\n";
}

fs::path temporary_folder() {
  std::string pattern = (fs::temp_directory_path() / "demslam-live.XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw Error(pattern + ": cannot be made");
  return pattern;
}

}  // namespace

RunSnapshot::RunSnapshot(const fs::path& run) {
  const fs::path absolute = fs::absolute(run).lexically_normal();
  if (!fs::exists(absolute / "map.db")) throw Error(run.string() + ": has no map yet");
  const MapStore map = MapStore::open_read_only(absolute / "map.db");
  const Progressed progress = progress_of(map);
  if (progress.trajectory.empty()) throw Error(run.string() + ": has placed no keyframe yet");
  const fs::path name = absolute.has_filename() ? absolute.filename() : absolute.parent_path().filename();
  path_ = temporary_folder() / name;
  fs::create_directory(path_);
  write_text(path_ / "trajectory.tum", tum_text(progress.trajectory));
  write_text(path_ / "odometry.tum", tum_text(progress.odometry));
  write_text(path_ / "frames.jsonl", progress.records);
  write_text(path_ / "config.toml", map.header().config_toml);
  write_text(path_ / "summary.json", summary_of(map, progress));
  for (const char* same : {"map.db", "timings.csv"}) {
    if (fs::exists(absolute / same)) fs::create_symlink(absolute / same, path_ / same);
  }
}

RunSnapshot::~RunSnapshot() {
  std::error_code ignored;
  fs::remove_all(path_.parent_path(), ignored);
}

}  // namespace demslam

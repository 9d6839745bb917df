#include "demslam/report/run_files.h"

#include <nlohmann/json.hpp>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

using Json = nlohmann::json;

LoopLine loop_of(const Json& json) {
  LoopLine loop{
      .status = json.value("status", ""), .reason = json.value("reason", ""), .inliers = json.value("inliers", 0)};
  if (json.contains("keyframe")) loop.keyframe = json["keyframe"].get<std::size_t>();
  return loop;
}

FrameLine frame_of(const Json& json) {
  FrameLine frame{.index = json.at("frame").get<std::size_t>(),
                  .t_ns = json.at("t_ns").get<TimestampNs>(),
                  .status = json.value("status", ""),
                  .reason = json.value("reason", ""),
                  .keypoints = json.value("keypoints", 0.0),
                  .stereo_points = json.value("stereo_points", 0.0),
                  .matches = json.value("matches", 0.0),
                  .inliers = json.value("inliers", 0.0),
                  .rms_px = json.value("rms_px", 0.0)};
  if (json.contains("keyframe")) frame.keyframe = json["keyframe"].get<std::size_t>();
  if (json.contains("loop")) frame.loop = loop_of(json["loop"]);
  return frame;
}

/// Through the last line's end.
std::string whole_lines(const std::filesystem::path& file) {
  std::string text = read_text(file);
  text.resize(text.rfind('\n') + 1);
  return text;
}

}  // namespace

std::vector<FrameLine> read_frame_lines(const std::filesystem::path& run) {
  const std::filesystem::path file = run / "frames.jsonl";
  std::vector<FrameLine> frames;
  if (!std::filesystem::exists(file)) return frames;
  std::istringstream stream(whole_lines(file));
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    try {
      frames.push_back(frame_of(Json::parse(line)));
    } catch (const Json::exception&) {
      throw Error::at(file.string(), number, "this is no frame record; is the run folder complete?");
    }
  }
  return frames;
}

Columns read_timings(const std::filesystem::path& run) {
  const std::filesystem::path file = run / "timings.csv";
  if (!std::filesystem::exists(file)) return {};
  const TextTable table = parse_table(whole_lines(file), file.string());
  Columns columns;
  if (table.rows.empty()) return columns;
  const std::vector<std::string>& names = table.rows.front().fields;
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (names[c] == "frame") continue;
    Column& column = columns.emplace_back(Column{names[c], {}});
    for (std::size_t r = 1; r < table.rows.size(); ++r) {
      column.values.push_back(static_cast<float>(table.number(table.rows[r], c)));
    }
  }
  return columns;
}

}  // namespace demslam

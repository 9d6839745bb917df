#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/slam/summary.h"
#include "demslam/store/map_check.h"
#include "demslam/store/map_export.h"
#include "demslam/store/map_info.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

void write_json(const fs::path& file, const Json& json) {
  std::ofstream stream(file);
  stream << json.dump(1) << "\n";
  if (!stream.flush()) throw Error(file.string() + ": cannot be written");
}

Json info_json(const fs::path& map, const MapInfo& info) {
  return {{"file", map.string()},
          {"schema", info.schema},
          {"demslam", info.version},
          {"keyframes", info.keyframes},
          {"frames", info.frames},
          {"odometry_factors", info.odometry_factors},
          {"loops", info.loops},
          {"loops_accepted", info.loops_accepted},
          {"features", info.features},
          {"landmarks", info.landmarks},
          {"descriptor_width", info.descriptor_width},
          {"length_m", info.length_m},
          {"duration_s", info.duration_s},
          {"file_bytes", info.file_bytes},
          {"bytes_per_km", info.bytes_per_km()}};
}

void info(const fs::path& map, const std::optional<fs::path>& json) {
  const MapInfo info = map_info(map);
  fmt::print("{}\n  made by    demslam {}, schema {}\n", map.string(), info.version, info.schema);
  fmt::print("  track      {:.1f} m in {:.1f} s, {} keyframes, {} frames\n", info.length_m, info.duration_s,
             info.keyframes, info.frames);
  fmt::print("  factors    {} odometry, {} loops tried, {} of them accepted\n", info.odometry_factors, info.loops,
             info.loops_accepted);
  fmt::print("  features   {} of width {}, {} with depth\n", info.features, info.descriptor_width, info.landmarks);
  fmt::print("  size       {:.1f} MB, {:.0f} MB per km\n", 1e-6 * static_cast<double>(info.file_bytes),
             1e-6 * info.bytes_per_km());
  if (json) write_json(*json, info_json(map, info));
}

void check(const fs::path& map, const std::optional<fs::path>& json) {
  const MapReport report = check_map(map);
  for (const std::string& problem : report.problems) fmt::print("{}\n", problem);
  if (json) write_json(*json, {{"file", map.string()}, {"problems", report.problems}});
  if (!report.problems.empty()) {
    throw Error(fmt::format("{}: {} problems; restore a copy, or remove it and run again", map.string(),
                            report.problems.size()));
  }
  fmt::print("{}: sound: {} keyframes, {} frames, {} factors\n", map.string(), report.keyframes, report.frames,
             report.factors);
}

void add_info(CLI::App& map) {
  auto file = std::make_shared<fs::path>();
  auto json = std::make_shared<std::optional<fs::path>>();
  CLI::App* command = map.add_subcommand("info", "what a map holds, and its size per kilometre");
  command->add_option("map", *file, "map.db, or the run folder it lies in")->required();
  command->add_option("--json", *json, "also write the figures as JSON");
  command->footer("Example:\n  demslam map info runs/anchored");
  command->callback([=] { info(map_file(*file), *json); });
}

void add_check(CLI::App& map) {
  auto file = std::make_shared<fs::path>();
  auto json = std::make_shared<std::optional<fs::path>>();
  CLI::App* command = map.add_subcommand("check", "read everything and tell what is damaged");
  command->add_option("map", *file, "map.db, or the run folder it lies in")->required();
  command->add_option("--json", *json, "also write the findings as JSON");
  command->footer("Example:\n  demslam map check runs/anchored");
  command->callback([=] { check(map_file(*file), *json); });
}

void add_export(CLI::App& map) {
  auto file = std::make_shared<fs::path>();
  auto output = std::make_shared<fs::path>();
  CLI::App* command = map.add_subcommand("export", "keyframes as TUM, factors as CSV, landmarks as PLY");
  command->add_option("map", *file, "map.db, or the run folder it lies in")->required();
  command->add_option("-o,--output", *output, "folder to write")->required();
  command->footer("Example:\n  demslam map export runs/anchored -o exported");
  command->callback([=] {
    for (const fs::path& written : export_map(map_file(*file), *output)) fmt::print("{}: written\n", written.string());
  });
}

}  // namespace

void add_map(CLI::App& app) {
  CLI::App* command = app.add_subcommand("map", "inspect, check and export the map of a run");
  command->require_subcommand(1);
  add_info(*command);
  add_check(*command);
  add_export(*command);
}

}  // namespace demslam::apps

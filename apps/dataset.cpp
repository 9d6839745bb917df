#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/convert.h"
#include "demslam/dataset/inspect.h"
#include "demslam/mapping/start_from.h"
#include "progress_bar.h"
#include "truth_options.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What every sub-command names: a dataset, its format where it is not recognised, and a calibration.
struct Source {
  fs::path path, calibration;
  std::string format;

  std::unique_ptr<StereoSequence> open() const { return open_dataset(path, format, calibration); }
};

void add_source(CLI::App& command, Source& source) {
  command.add_option("dataset", source.path, "folder or bag (demslam, lusnar, s3li, euroc, kitti, folders)")
      ->required();
  command.add_option("--format", source.format, "dataset format, when it is not recognised");
  command.add_option("--calibration", source.calibration, "calibration, replaces the dataset's own");
}

Json info_json(const fs::path& path, const DatasetInfo& info) {
  return {{"dataset", path.string()},
          {"format", info.format},
          {"pairs", info.pairs},
          {"unpaired", info.unpaired},
          {"width_px", info.width},
          {"height_px", info.height},
          {"duration_s", info.duration_s},
          {"median_rate_hz", info.median_rate_hz},
          {"longest_gap_s", info.longest_gap_s},
          {"baseline_m", info.baseline_m},
          {"focal_px", info.focal_px},
          {"has_dem", info.has_dem},
          {"has_start", info.has_start}};
}

void info(const Source& source, const std::optional<fs::path>& json) {
  const DatasetInfo info = inspect(*source.open());
  fmt::print("{}: {}\n  pairs      {} of {} x {} px, {} images without a partner\n", source.path.string(), info.format,
             info.pairs, info.width, info.height, info.unpaired);
  fmt::print("  time       {:.3f} s at {:.2f} Hz, longest gap {:.3f} s\n", info.duration_s, info.median_rate_hz,
             info.longest_gap_s);
  fmt::print("  stereo     baseline {:.4f} m, focal length {:.2f} px\n", info.baseline_m, info.focal_px);
  fmt::print("  with it    {}, {}\n", info.has_dem ? "a DEM" : "no DEM",
             info.has_start ? "a start pose" : "no start pose");
  if (json) write_text(*json, info_json(source.path, info).dump(1) + "\n");
}

void check(const Source& source, const DatasetCheckOptions& options, const std::optional<fs::path>& json) {
  ProgressBar bar("check", "frames");
  const DatasetCheck check = check_dataset(*source.open(), options, bar.progress());
  fmt::print(
      "{}: {} frames looked at\n  epipolar   right rows {:+.2f} px from left ones, spread {:.2f} px ({} patches)\n",
      source.path.string(), check.frames, check.rows.offset_px, check.rows.spread_px, check.rows.patches);
  for (const std::string& warning : check.warnings) fmt::print("warning: {}\n", warning);
  for (const std::string& problem : check.problems) fmt::print("problem: {}\n", problem);
  if (json) {
    const Json found = {{"dataset", source.path.string()},
                        {"frames", check.frames},
                        {"row_offset_px", check.rows.offset_px},
                        {"row_spread_px", check.rows.spread_px},
                        {"row_patches", check.rows.patches},
                        {"warnings", check.warnings},
                        {"problems", check.problems}};
    write_text(*json, found.dump(1) + "\n");
  }
  if (!check.problems.empty()) {
    throw Error(fmt::format("{}: {} of the {} frames cannot be read", source.path.string(), check.problems.size(),
                            check.frames));
  }
}

void convert(const Source& source, const std::string& format, const fs::path& output) {
  ProgressBar bar("convert", "pairs");
  const ConvertedDataset converted = convert_dataset(*source.open(), format, output, bar.progress());
  fmt::print("{}: {} pairs written as {}\n", output.string(), converted.pairs, format);
  if (!converted.T_body_newbody.matrix().isIdentity(1e-12)) {
    const Eigen::Vector3d& p = converted.T_body_newbody.translation();
    fmt::print("  its body is the camera, at ({:.3f}, {:.3f}, {:.3f}) m of the old one\n", p.x(), p.y(), p.z());
  }
}

struct StartArguments {
  Source source;
  fs::path poses, output;
  TruthOptions truth;
  StartFromOptions options;
};

void start(const StartArguments& a) {
  const Truth track = read_truth(a.poses, a.truth);
  const TimestampNs first_ns = a.source.open()->stamp_ns(0) + std::llround(1e9 * a.truth.clock_offset_s);
  write_text(a.output, start_pose_toml(start_from(track.file.poses, first_ns, a.options)));
  for (const std::string& note : track.notes) fmt::print("note: {}\n", note);
  fmt::print("{}: written\n", a.output.string());
}

void add_info(CLI::App& dataset) {
  auto source = std::make_shared<Source>();
  auto json = std::make_shared<std::optional<fs::path>>();
  CLI::App* command = dataset.add_subcommand("info", "format, pairs, rate, calibration");
  add_source(*command, *source);
  command->add_option("--json", *json, "also write the figures as JSON");
  command->footer("Example:\n  demslam dataset info runs/data");
  command->callback([=] { info(*source, *json); });
}

void add_check(CLI::App& dataset) {
  auto source = std::make_shared<Source>();
  auto options = std::make_shared<DatasetCheckOptions>();
  auto json = std::make_shared<std::optional<fs::path>>();
  CLI::App* command =
      dataset.add_subcommand("check", "read images, measure row offset and epipolar error on them, warn");
  add_source(*command, *source);
  command->add_option("--frames", options->frames, "look at so many, spread over the sequence; 0: every one");
  command->add_option("--json", *json, "also write the findings as JSON");
  command->footer("Example:\n  demslam dataset check runs/data --frames 5");
  command->callback([=] { check(*source, *options, *json); });
}

void add_convert(CLI::App& dataset) {
  auto source = std::make_shared<Source>();
  auto format = std::make_shared<std::string>();
  auto output = std::make_shared<fs::path>();
  CLI::App* command = dataset.add_subcommand("convert", "write it as demslam, EuRoC, KITTI or a ROS 1 bag");
  add_source(*command, *source);
  command->add_option("--to", *format, "demslam, euroc, kitti or rosbag")
      ->required()
      ->check(CLI::IsMember(writable_formats()));
  command->add_option("-o,--output", *output, "folder (rosbag: file) to write")->required();
  command->footer("Example:\n  demslam dataset convert runs/data --to euroc -o runs/data_euroc");
  command->callback([=] { convert(*source, *format, *output); });
}

void add_start(CLI::App& dataset) {
  auto a = std::make_shared<StartArguments>();
  CLI::App* command = dataset.add_subcommand("start", "a start.toml from a known track at the first frame");
  add_source(*command, a->source);
  command->add_option("--poses", a->poses, "track that the mission knows (trajectory, .pos, longitude/latitude CSV)")
      ->required();
  command->add_option("-o,--output", a->output, "start.toml to write")->required();
  command->add_option("--heading-path-m", a->options.heading_path_m,
                      "without orientations: heading of the way to a position so far off");
  command->add_option("--sigma-position-m", a->options.sigma_position_m, "how well the position is known");
  command->add_option("--sigma-rotation-deg", a->options.sigma_rotation_deg,
                      "how well the attitude is known; default: 0.1, without orientations 5");
  add_geodetic_options(*command, a->truth);
  command->add_option("--clock-offset-s", a->truth.clock_offset_s, "added to the first frame's stamp");
  command->footer("Example:\n  demslam dataset start runs/data --poses runs/data/gt.txt -o start.toml");
  command->callback([=] { start(*a); });
}

}  // namespace

void add_dataset(CLI::App& app) {
  CLI::App* command = app.add_subcommand("dataset", "inspect, check and convert stereo datasets");
  command->require_subcommand(1);
  add_info(*command);
  add_check(*command);
  add_convert(*command);
  add_start(*command);
}

}  // namespace demslam::apps

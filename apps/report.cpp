#include <fmt/format.h>

#include <filesystem>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/report/report_page.h"
#include "demslam/report/run_snapshot.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<fs::path> runs;
  fs::path output;
  std::optional<fs::path> truth, dem;
  PageOptions page;
};

/// What stands for each run: one that goes on, or was killed, has its map alone.
std::vector<fs::path> run_folders(const std::vector<fs::path>& runs, std::list<RunSnapshot>& snapshots) {
  std::vector<fs::path> folders;
  for (const fs::path& run : runs) {
    const bool ended = fs::exists(run / "summary.json") || !fs::exists(run / "map.db");
    if (!ended) fmt::print(stderr, "{}: has not ended; shown as far as its map goes\n", run.string());
    folders.push_back(ended ? run : snapshots.emplace_back(run).path());
  }
  return folders;
}

void run(const Arguments& arguments) {
  std::list<RunSnapshot> snapshots;
  const Report report = read_report(run_folders(arguments.runs, snapshots), arguments.truth, arguments.dem);
  const std::string extension = arguments.output.extension().string();
  if (extension == ".png") {
    write_map_picture(report, arguments.output);
  } else if (extension == ".html") {
    write_html(report, arguments.output, arguments.page);
  } else {
    throw Error(arguments.output.string() + ": name the report *.html (page) or *.png (map alone)");
  }
  fmt::print("{}: written\n", arguments.output.string());
}

}  // namespace

void add_report(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("report", "a page or a map of one or more runs");
  command->add_option("runs", arguments->runs, "run folders")->required();
  command->add_option("-o,--output", arguments->output, "*.html: one self-contained page; *.png: the map alone")
      ->required();
  command->add_option("--truth", arguments->truth, "true trajectory; default: the one of the run's dataset");
  command->add_option("--dem", arguments->dem, "elevation model of the map; default: the runs' own");
  command->add_option("--images", arguments->page.images, "keyframe images in the page, all runs together; 0: none")
      ->capture_default_str();
  command->footer("Example:\n  demslam report runs/odometry runs/anchored -o report.html");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace demslam::apps

#include "experiments.h"

#include <fmt/format.h>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/markdown.h"

namespace demslam::apps {

void add_experiment(CLI::App& app) {
  CLI::App* experiments = app.add_subcommand("experiment", "one published table each, end to end");
  experiments->require_subcommand(1);
  add_terrain_experiment(*experiments);
  add_published_experiments(*experiments);
  add_fixes_experiment(*experiments);
  add_loops_experiment(*experiments);
  add_scale_experiment(*experiments);
  add_frontend_experiment(*experiments);
  add_drift_experiment(*experiments);
}

std::filesystem::path scene_presets(const std::filesystem::path& asked) {
  namespace fs = std::filesystem;
  if (!asked.empty()) return asked;
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& folder :
       {program / "../share/demslam/configs", program / "../../configs", fs::path("configs")}) {
    if (fs::is_regular_file(folder / "traverse_378m.toml")) return folder;
  }
  throw Error("experiment: no scene presets are found; pass --configs with demslam's configs/ folder");
}

void write_experiment(const std::filesystem::path& folder, const std::string& name, const Table& table,
                      const std::string& json) {
  write_text(folder / (name + ".md"), markdown_table(table));
  write_text(folder / (name + ".csv"), csv_table(table));
  write_text(folder / (name + ".json"), json);
  fmt::print("{}", text_table(table));
}

}  // namespace demslam::apps

#include "demslam/evaluation/evaluate.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/runs.h"
#include "demslam/evaluation/table.h"
#include "truth_options.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<fs::path> runs;
  std::optional<fs::path> truth, json, csv, latex;
  EvaluationOptions options;
  TruthOptions truth_options;
  bool all_pairs = false;
};

std::string name_of_run(fs::path path) {
  path = fs::absolute(path).lexically_normal();
  return path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
}

std::string json_text(const std::vector<NamedEvaluation>& evaluations) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const auto& [name, evaluation] : evaluations) {
    nlohmann::ordered_json one = {{"run", name}};
    one.update(nlohmann::ordered_json::parse(evaluation_json(evaluation)));
    all.push_back(one);
  }
  return (all.size() == 1 ? all.front() : all).dump(1) + "\n";
}

void print_consistency(const std::vector<NamedEvaluation>& evaluations) {
  for (const auto& [name, evaluation] : evaluations) {
    if (evaluation.nees) fmt::print("consistency: {}: {}\n", name, describe(*evaluation.nees));
  }
}

void print_notes(const std::vector<NamedEvaluation>& evaluations) {
  for (const auto& [name, evaluation] : evaluations) {
    for (const std::string& note : evaluation.notes) fmt::print("note: {}: {}\n", name, note);
  }
}

void run(Arguments arguments) {
  if (arguments.all_pairs) arguments.options.rpe.pairs = RpePairs::all;
  std::vector<NamedEvaluation> evaluations;
  for (const fs::path& path : arguments.runs) {
    evaluations.emplace_back(name_of_run(path),
                             evaluate_run(path, arguments.truth, arguments.options, arguments.truth_options));
  }
  const Table table = evaluation_table(evaluations);
  fmt::print("{}", text_table(table));
  print_consistency(evaluations);
  print_notes(evaluations);
  if (arguments.json) write_text(*arguments.json, json_text(evaluations));
  if (arguments.csv) write_text(*arguments.csv, csv_table(table));
  if (arguments.latex) write_text(*arguments.latex, latex_table(table));
}

void add_rpe_options(CLI::App& command, Arguments& arguments) {
  static const std::map<std::string, DeltaUnit> units{
      {"f", DeltaUnit::frames}, {"m", DeltaUnit::metres}, {"s", DeltaUnit::seconds}};
  command.add_option("--delta", arguments.options.rpe.delta, "RPE over this much");
  command.add_option("--delta-unit", arguments.options.rpe.unit, "f (frames), m (metres) or s (seconds)")
      ->transform(CLI::CheckedTransformer(units).description("UNIT"));
  command.add_flag("--all-pairs", arguments.all_pairs, "RPE from every pose, not only consecutive pairs");
}

}  // namespace

void add_evaluate(CLI::App& app) {
  static const std::map<std::string, Alignment> alignments{{"none", Alignment::none},
                                                           {"first-pose", Alignment::first_pose},
                                                           {"se3", Alignment::se3},
                                                           {"sim3", Alignment::sim3}};
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("evaluate", "ATE, RPE and drift against the truth, as evo computes them");
  command->add_option("runs", arguments->runs, "run folders or trajectory files (TUM, KITTI, EuRoC, LuSNAR)")
      ->required();
  command->add_option("--truth", arguments->truth,
                      "true trajectory, RTKLIB .pos or longitude/latitude CSV; default: the one of the run's dataset");
  add_geodetic_options(*command, arguments->truth_options);
  add_clock_offset(*command, arguments->truth_options);
  command->add_option("--align", arguments->options.alignment, "none, first-pose, se3 or sim3")
      ->transform(CLI::CheckedTransformer(alignments).description("NAME"));
  command->add_option("--max-difference-s", arguments->options.association.max_difference_s,
                      "stamps further apart do not pair");
  add_rpe_options(*command, *arguments);
  command->add_option("--json", arguments->json, "one object per run (one run: the object itself)");
  command->add_option("--csv", arguments->csv, "the table as CSV");
  command->add_option("--latex", arguments->latex, "the table for LaTeX (booktabs)");
  command->footer(
      "Examples:\n  demslam evaluate runs/odometry runs/anchored --json e.json\n"
      "  demslam evaluate estimate.txt --truth truth.txt --align se3\n"
      "  demslam evaluate runs/etna --truth global_lle.pos --dem-heights geoid --geoid-undulation-m 43.46 "
      "--clock-offset-s auto");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace demslam::apps

#include "demslam/evaluation/runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/evaluation/clock_offset.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::array kTruthFiles = {"gt.txt",
                                    "Rover_pose.txt",
                                    "poses.txt",
                                    "mav0/state_groundtruth_estimate0/data.csv",
                                    "mav0/mocap0/data.csv",
                                    "ground_truth_tum.txt"};

std::optional<fs::path> truth_of_dataset(const fs::path& dataset) {
  for (const char* name : kTruthFiles) {
    if (fs::is_regular_file(dataset / name)) return dataset / name;
  }
  const fs::path folder = fs::weakly_canonical(dataset);  // .../sequences/00 has .../poses/00.txt
  const fs::path kitti = folder.parent_path().parent_path() / "poses" / (folder.filename().string() + ".txt");
  if (fs::is_regular_file(kitti)) return kitti;
  return std::nullopt;
}

Json parse_json(const std::string& text, const std::string& source, int line) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error&) {
    throw Error::at(source, line, "this is no JSON; is the run folder complete?");
  }
}

Json summary_of(const fs::path& run) {
  const fs::path file = run / "summary.json";
  return parse_json(read_text(file), file.string(), 1);
}

fs::path dataset_of_run(const fs::path& run) {
  const Json summary = summary_of(run);
  const Json::json_pointer key("/inputs/dataset");
  if (!summary.contains(key) || !summary[key].is_string()) {
    throw Error((run / "summary.json").string() + ": 'inputs.dataset' is missing");
  }
  return summary[key].get<std::string>();
}

std::optional<Nees> nees_of(const fs::path& run, const TrajectoryFile& estimate, const Evaluation& evaluation) {
  std::map<TimestampNs, Eigen::Matrix3d> rotations;
  for (const StampedPose& pose : estimate.poses) rotations[pose.t_ns] = pose.pose.rotation_matrix();
  std::map<TimestampNs, Eigen::Vector3d> errors;
  for (const PoseError& error : evaluation.errors) errors[error.t_ns] = error.error_m;
  std::vector<Eigen::Vector3d> paired_errors;
  std::vector<Eigen::Matrix3d> covariances;
  for (const StampedCovariance& stamped : read_covariances(run)) {
    const auto error = errors.find(stamped.t_ns);
    if (error == errors.end()) continue;
    const Eigen::Matrix3d& R = rotations.at(stamped.t_ns);
    paired_errors.push_back(error->second);
    covariances.push_back(R * stamped.covariance.bottomRightCorner<3, 3>() * R.transpose());
  }
  if (paired_errors.empty()) return std::nullopt;
  return nees(paired_errors, covariances);
}

}  // namespace

std::optional<fs::path> truth_file(const fs::path& run_or_trajectory, const std::optional<fs::path>& given) {
  if (given && !fs::is_directory(*given)) return given;
  return find_truth(given.value_or(run_or_trajectory));
}

std::optional<fs::path> dem_of_run(const fs::path& run) {
  if (!fs::is_regular_file(run / "summary.json")) return std::nullopt;
  const Json summary = summary_of(run);
  const Json::json_pointer key("/inputs/dem/path");
  if (!summary.contains(key)) return std::nullopt;
  return summary[key].get<std::string>();
}

bool pairs_by_index(const TrajectoryFile& truth, const TrajectoryFile& estimate) {
  if (truth.indexed && estimate.indexed) return true;
  return (truth.indexed || estimate.indexed) && truth.poses.size() == estimate.poses.size();
}

double clock_offset_of(const Trajectory& truth, const Trajectory& estimate, const TruthOptions& options) {
  return options.estimate_clock_offset ? estimate_clock_offset(truth, estimate).offset_s : options.clock_offset_s;
}

bool is_run_folder(const fs::path& path) { return fs::is_regular_file(path / "trajectory.tum"); }

std::optional<fs::path> find_truth(const fs::path& dataset_or_run) {
  const bool is_run = fs::is_regular_file(dataset_or_run / "summary.json");
  return truth_of_dataset(is_run ? dataset_of_run(dataset_or_run) : dataset_or_run);
}

std::vector<TimestampNs> frame_stamps(const fs::path& run) {
  const fs::path file = run / "frames.jsonl";
  if (!fs::is_regular_file(file)) return {};
  std::istringstream lines(read_text(file));
  std::vector<TimestampNs> stamps;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    const Json record = parse_json(line, file.string(), ++number);
    if (!record.contains("t_ns")) throw Error::at(file.string(), number, "'t_ns' is missing");
    stamps.push_back(record["t_ns"].get<TimestampNs>());
  }
  return stamps;
}

std::vector<StampedCovariance> read_covariances(const fs::path& run) {
  const fs::path file = run / "covariance.csv";
  if (!fs::is_regular_file(file)) return {};
  const TextTable table = read_table(file);
  std::vector<StampedCovariance> covariances;
  for (const TextRow& row : table.rows) {
    if (row.fields.front() == "t_ns") continue;  // the header
    if (row.fields.size() != 37) table.fail(row, "a line must be t_ns and the 36 numbers of the covariance");
    StampedCovariance stamped{table.integer(row, 0)};
    for (std::size_t i = 0; i < 36; ++i) stamped.covariance(i / 6, i % 6) = table.number(row, i + 1);
    covariances.push_back(stamped);
  }
  return covariances;
}

Evaluation evaluate_run(const fs::path& run_or_trajectory, const std::optional<fs::path>& given_truth,
                        EvaluationOptions options, TruthOptions truth_options) {
  const bool is_run = fs::is_directory(run_or_trajectory);
  const auto file = truth_file(run_or_trajectory, given_truth);
  if (!file) {
    throw Error(given_truth.value_or(run_or_trajectory).string() +
                ": no ground truth is found with it; pass --truth FILE");
  }
  if (!truth_options.dem) truth_options.dem = dem_of_run(run_or_trajectory);
  Truth truth = read_truth(*file, truth_options);
  const TrajectoryFile estimate = read_trajectory(is_run ? run_or_trajectory / "trajectory.tum" : run_or_trajectory);
  options.association.by_index = pairs_by_index(truth.file, estimate);
  options.association.offset_s = clock_offset_of(truth.file.poses, estimate.poses, truth_options);
  if (truth_options.estimate_clock_offset) {
    truth.notes.push_back(
        fmt::format("clock: {:.3f} s added to the stamps of the estimate, as estimated from the "
                    "aligned positions",
                    options.association.offset_s));
  }
  if (is_run && options.frame_stamps.empty()) options.frame_stamps = frame_stamps(run_or_trajectory);
  Evaluation evaluation = evaluate(truth.file.poses, estimate.poses, options);
  if (is_run && options.alignment == Alignment::none)
    evaluation.nees = nees_of(run_or_trajectory, estimate, evaluation);
  evaluation.notes.insert(evaluation.notes.begin(), truth.notes.begin(), truth.notes.end());
  return evaluation;
}

}  // namespace demslam

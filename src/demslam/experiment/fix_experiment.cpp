#include "demslam/experiment/fix_experiment.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/experiment/parallel.h"
#include "demslam/geometry/angle.h"
#include "demslam/geometry/covariance.h"

namespace demslam {
namespace {

constexpr double kWrong_m = 5.0;
constexpr std::uint64_t kTrialStream = 101;

const char* name_of(Relief relief) {
  switch (relief) {
    case Relief::flat:
      return "flat";
    case Relief::mare:
      return "mare";
    case Relief::mid:
      return "mid";
    case Relief::highland:
      return "highland";
  }
  return "";
}

/// What became of one search.
struct Trial {
  std::string start;
  bool accepted = false;
  double error_m = 0.0, nis = 0.0;
};

Trial trial_of(const std::string& start, const TerrainFix& fix, const Pose& truth) {
  Trial trial{.start = start, .accepted = fix.accepted()};
  if (!trial.accepted) return trial;
  const Eigen::Vector2d error = (fix.T_map_body.translation() - truth.translation()).head<2>();
  const Eigen::Matrix2d covariance = position_covariance(fix.T_map_body, fix.covariance).topLeftCorner<2, 2>();
  trial.error_m = error.norm();
  trial.nis = 0.5 * error.dot(covariance.inverse() * error);
  return trial;
}

/// One world: its ground as seen along the way, and every submap searched for.
class World {
 public:
  World(const FixExperiment& experiment, const TraverseOptions& options)
      : experiment_(experiment),
        traverse_(make_traverse(options)),
        dem_(std::make_shared<Dem>(experiment.foreign ? another_world(options).dem : traverse_.dem)),
        random_(options.seed, kTrialStream),
        odometry_({.systematic = OdometryErrors().as_states()}) {
    odometry_.add_keyframe(traverse_.T_map_body.front());
    odometry_.add_prior(0, traverse_.T_map_body.front(), traverse_.start_covariance);
    for (const RelativePose& motion : traverse_.odometry) {
      odometry_.add_keyframe(odometry_.T_map_body(motion.i) * motion.T_i_j);
      odometry_.add_odometry(motion);
    }
  }

  std::vector<Trial> trials() {
    const double spacing_m = traverse_.odometry.front().T_i_j.translation().norm();
    const auto length = static_cast<std::size_t>(experiment_.submap.length_m / spacing_m);
    const auto step = static_cast<std::size_t>(experiment_.submap.every_m / spacing_m);
    for (std::size_t begin = 0; begin + length < traverse_.T_map_body.size(); begin += step) search(begin, length);
    return trials_;
  }

 private:
  static Traverse another_world(TraverseOptions options) {
    options.seed += 1'000'000;
    return make_traverse(options);
  }

  void search(std::size_t begin, std::size_t length) {
    const std::size_t middle = begin + length / 2;
    const auto submap = seen(begin, length, middle);
    if (!submap) return;
    const Matrix6d bend = *odometry_.odometry_bend(begin, middle, begin + length);
    const Pose& truth = traverse_.T_map_body[middle];
    for (const double error_m : experiment_.start_errors_m) {
      const double sigma_m = error_m / 1.5;
      Vector6d variance;
      variance << Eigen::Vector3d::Constant(std::pow(experiment_.heading_error_deg * kRadPerDeg, 2)),
          Eigen::Vector3d::Constant(sigma_m * sigma_m);
      TerrainFix fix = align_submap(*submap, displaced(truth, error_m), variance.asDiagonal(), dem_,
                                    experiment_.dem_error, {}, experiment_.submap);
      fix.covariance += bend;
      trials_.push_back(trial_of(fmt::format("{:g} m", error_m), fix, truth));
    }
    if (experiment_.global_radius_m > 0.0) search_everywhere(*submap, bend, truth);
  }

  void search_everywhere(const TerrainPatch& submap, const Matrix6d& bend, const Pose& truth) {
    const double r = 0.8 * experiment_.global_radius_m;
    const Eigen::Vector2d centre =
        truth.translation().head<2>() + Eigen::Vector2d(random_.uniform(-r, r), random_.uniform(-r, r));
    TerrainFix fix = global_fix(submap, truth, dem_, experiment_.dem_error, {},
                                {.centre_m = centre, .radius_m = experiment_.global_radius_m});
    fix.covariance += bend;
    trials_.push_back(trial_of("anywhere", fix, truth));
  }

  /// The ground of a stretch, joined by odometry alone.
  std::optional<TerrainPatch> seen(std::size_t begin, std::size_t length, std::size_t middle) {
    const Pose T_map_reckoned = traverse_.T_map_body[middle] * odometry_.T_map_body(middle).inverse();
    std::vector<PosedLandmarks> views;
    for (std::size_t k = begin; k <= begin + length; ++k) {
      views.push_back(
          {T_map_reckoned * odometry_.T_map_body(k) * traverse_.T_body_left, &traverse_.landmarks[k].points});
    }
    return build_patch(views, middle, traverse_.T_map_body[middle], *dem_, {});
  }

  Pose displaced(const Pose& truth, double error_m) {
    const double direction = random_.uniform(0.0, 2.0 * std::numbers::pi);
    const double turn = experiment_.heading_error_deg * kRadPerDeg * random_.normal();
    return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())) * truth.rotation(),
            truth.translation() + error_m * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0.0)};
  }

  const FixExperiment& experiment_;
  Traverse traverse_;
  std::shared_ptr<const Dem> dem_;
  Random random_;
  PoseGraph odometry_;
  std::vector<Trial> trials_;
};

FixRow row_of(Relief relief, const std::string& start, const std::vector<Trial>& trials, bool foreign) {
  FixRow row{.relief = name_of(relief), .start = start};
  std::vector<double> errors;
  for (const Trial& trial : trials) {
    if (trial.start != start) continue;
    ++row.trials;
    if (!trial.accepted) continue;
    row.wrong += foreign || trial.error_m > kWrong_m;
    row.mean_nis += trial.nis;
    errors.push_back(trial.error_m);
  }
  row.accepted = static_cast<int>(errors.size());
  if (errors.empty()) return row;
  std::sort(errors.begin(), errors.end());
  row.median_error_m = errors[errors.size() / 2];
  row.worst_error_m = errors.back();
  row.mean_nis /= static_cast<double>(errors.size());
  return row;
}

}  // namespace

std::vector<FixRow> fix_experiment(const FixExperiment& experiment, const Progress& progress) {
  const auto seeds = static_cast<std::size_t>(experiment.seeds);
  std::vector<std::vector<Trial>> worlds(experiment.reliefs.size() * seeds);
  for_each_in_parallel(worlds.size(), experiment.threads, progress, [&](std::size_t i) {
    TraverseOptions options = experiment.traverse;
    options.relief = experiment.reliefs[i / seeds];
    options.seed = experiment.first_seed + i % seeds;
    worlds[i] = World(experiment, options).trials();
  });
  std::vector<FixRow> rows;
  for (std::size_t r = 0; r < experiment.reliefs.size(); ++r) {
    std::vector<Trial> trials;
    for (std::size_t s = 0; s < seeds; ++s)
      trials.insert(trials.end(), worlds[r * seeds + s].begin(), worlds[r * seeds + s].end());
    for (const double error_m : experiment.start_errors_m)
      rows.push_back(row_of(experiment.reliefs[r], fmt::format("{:g} m", error_m), trials, experiment.foreign));
    if (experiment.global_radius_m > 0.0)
      rows.push_back(row_of(experiment.reliefs[r], "anywhere", trials, experiment.foreign));
  }
  return rows;
}

Table fix_table(const std::vector<FixRow>& rows) {
  Table table{
      .title = "Searches for submaps; wrong: accepted and more than 5 m off",
      .header = {"relief", "start off by", "trials", "accepted", "wrong", "median error [m]", "worst [m]", "NIS"}};
  for (const FixRow& r : rows) {
    table.rows.push_back({r.relief, r.start, std::to_string(r.trials), std::to_string(r.accepted),
                          std::to_string(r.wrong), fmt::format("{:.2f}", r.median_error_m),
                          fmt::format("{:.2f}", r.worst_error_m), fmt::format("{:.2f}", r.mean_nis)});
  }
  return table;
}

}  // namespace demslam

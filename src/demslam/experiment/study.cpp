#include "demslam/experiment/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/config/slam_config.h"
#include "demslam/dem/dem.h"
#include "demslam/evaluation/runs.h"
#include "demslam/sim/rendered_sequence.h"
#include "demslam/sim/simulate.h"
#include "demslam/sim/surveyed_ground.h"
#include "demslam/slam/replay.h"
#include "demslam/slam/run.h"
#include "demslam/slam/summary.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// An interrupted run has a summary, too.
bool is_finished(const fs::path& run) {
  const fs::path summary = run / "summary.json";
  return fs::is_regular_file(summary) && demslam::is_finished(read_text(summary), 0);
}

/// One drive with one seed, in its folder.
class StudyCase {
 public:
  StudyCase(const Study& study, const StudyDrive& drive, std::uint64_t seed, const fs::path& out)
      : study_(study), drive_(drive), seed_(seed), folder_(study_folder(out, drive, seed)) {}

  /// False: stopped before the end.
  bool run(const Progress& progress) {
    for (const StudyVariant& variant : study_.variants) {
      if (is_finished(folder_ / variant.name)) continue;
      if (!is_recorded() && !record(progress)) return false;
      solve(variant);
    }
    if (!study_.keep_recordings) fs::remove(recording() / "map.db");  // the features of every keyframe: large
    return true;
  }

  std::vector<StudyScore> scores() const {
    std::vector<StudyScore> all(study_.variants.size());
    std::ranges::transform(study_.variants, all.begin(), [this](const StudyVariant& v) { return score(v.name); });
    return all;
  }

 private:
  fs::path data() const { return folder_ / "data"; }
  fs::path recording() const { return folder_ / "recording"; }

  bool is_recorded() const { return is_finished(recording()) && fs::exists(recording() / "map.db"); }

  /// The odometry, once; again when its features have not been kept.
  bool record(const Progress& progress) const {
    if (is_finished(recording())) fs::remove_all(recording());
    SceneOptions scene = drive_.scene;
    scene.seed = seed_;
    scene.output.images = false;
    if (!is_rendered_dataset(data())) simulate(scene, data());
    SlamOptions options = study_.variants.front().options;
    options.use_dem = options.use_loops = false;
    RunInputs inputs{.dataset = data(), .output = recording(), .config_toml = to_toml(options)};
    inputs.open = [](const fs::path& dataset, const std::string&, const fs::path& calibration) {
      return open_rendered_dataset(dataset, calibration);
    };
    return !run_slam(inputs, options, progress).interrupted;
  }

  void solve(const StudyVariant& variant) const {
    replay({.run = recording(),
            .dem = dem_of(variant),
            .output = folder_ / variant.name,
            .config_toml = to_toml(variant.options)},
           variant.options);
  }

  fs::path dem_of(const StudyVariant& variant) const {
    switch (variant.dem) {
      case StudyDem::ground:
        return perturbed_dem(variant);
      case StudyDem::lidar:
        return lidar_dem();
      case StudyDem::orbital:
        break;
    }
    return data() / "dem.tif";
  }

  fs::path perturbed_dem(const StudyVariant& variant) const {
    Perturbation errors = variant.errors;
    errors.noise_m.seed = seed_;
    const fs::path file = folder_ / ("dem_" + variant.name + ".tif");
    write_dem(file, perturb(read_dem(data() / "truth" / "dem_truth.tif"), errors));
    return file;
  }

  fs::path lidar_dem() const {
    constexpr double kScanSpacing_m = 4.0;
    const fs::path file = folder_ / "dem_lidar.tif";
    if (fs::exists(file)) return file;
    Mission mission(read_scene(data() / "scene.toml"));
    write_dem(file, surveyed_ground(mission, kScanSpacing_m, {.cell_m = 1.0}).heights);
    return file;
  }

  StudyScore score(const std::string& variant) const {
    const Evaluation e = evaluate_run(folder_ / variant, std::nullopt, {});
    return {.drive = drive_.name,
            .variant = variant,
            .seed = seed_,
            .path_m = e.path_length_m,
            .completion = e.completion,
            .ate_m = e.ate.rmse,
            .horizontal_m = e.ate_horizontal.rmse,
            .vertical_m = e.ate_vertical.rmse,
            .ate_star = e.ate_star,
            .drift_percent = e.drift_percent,
            .rpe_m = e.rpe ? e.rpe->rmse : std::nan(""),
            .nees = e.nees ? e.nees->position.mean / 3.0 : std::nan("")};
  }

  const Study& study_;
  const StudyDrive& drive_;
  std::uint64_t seed_;
  fs::path folder_;
};

/// The progress of one case among all.
Progress share_of(const Progress& whole, std::size_t index, std::size_t count) {
  return {.report = [&whole, index, count](std::size_t done,
                                           std::size_t total) { whole.report(index * total + done, count * total); },
          .stop = whole.stop};
}

}  // namespace

fs::path study_folder(const fs::path& out, const StudyDrive& drive, std::uint64_t seed) {
  return out / fmt::format("{}_s{}", drive.name, seed);
}

std::vector<StudyScore> run_study(const Study& study, const fs::path& out, const Progress& progress) {
  std::vector<StudyScore> scores;
  const std::size_t count = study.seeds.size() * study.drives.size();
  std::size_t index = 0;
  for (const std::uint64_t seed : study.seeds) {
    for (const StudyDrive& drive : study.drives) {
      StudyCase one(study, drive, seed, out);
      if (!one.run(share_of(progress, index++, count))) return scores;
      const auto more = one.scores();
      scores.insert(scores.end(), more.begin(), more.end());
    }
  }
  return scores;
}

std::optional<Spread> spread_of(const std::vector<StudyScore>& scores, const std::string& variant, StudyFigure figure,
                                const std::string& drive) {
  std::vector<double> values;
  for (const StudyScore& score : scores) {
    if (score.variant == variant && (drive.empty() || score.drive == drive)) values.push_back(score.*figure);
  }
  if (values.empty()) return std::nullopt;
  return spread_of(std::move(values));
}

}  // namespace demslam

#include "demslam/experiment/published.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "demslam/experiment/estimator.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// The image-free experiment's way of anchoring, with images.
SlamOptions as(const Estimator& estimator) {
  SlamOptions options;
  options.use_dem = estimator.anchored;
  options.anchoring = estimator.anchoring;
  options.graph.systematic.enabled = estimator.systematic.enabled;
  return options;
}

SlamOptions without_loops(SlamOptions options) {
  options.use_loops = false;
  return options;
}

std::vector<StudyVariant> usual_variants() {
  return {{"odometry", without_loops(as(odometry_only()))},
          {"published", as(published_factors())},
          {"full_gradient", as(full_gradient())},
          {"default", SlamOptions()}};
}

/// On the map that the rover's own LiDAR has gathered: in its place, centimetres of noise, and of height as a whole,
/// since rocks raise the mean of a cell. (The published factors know no bias.)
StudyVariant on_lidar(const std::string& name, SlamOptions options) {
  options.anchoring.sigma_dem_m = 0.05;
  options.anchoring.dem_correlation_m = 1.0;
  options.anchoring.sigma_bias_m = std::min(options.anchoring.sigma_bias_m, 0.05);
  options.anchoring.sigma_shift_m = 0.0;
  return {name, options, StudyDem::lidar};
}

/// No file but the poses is needed of the other sensors here; `quick` drives a straight 40 m of small images instead.
StudyDrive drive_of(const std::string& name, const fs::path& preset, const ExperimentExtent& extent) {
  StudyDrive drive{name, read_scene(preset)};
  drive.scene.output = {.depth = false, .labels = false, .lidar = false, .imu = false, .wheels = false};
  if (extent.frame_spacing_m > 0.0) drive.scene.rover.space_frames(extent.frame_spacing_m);
  if (extent.size_px > 0) drive.scene.camera.width_px = drive.scene.camera.height_px = extent.size_px;
  if (!extent.quick) return drive;
  drive.scene.camera.width_px = drive.scene.camera.height_px = 256;
  drive.scene.rover.route = RouteKind::straight;
  drive.scene.rover.length_m = 40.0;
  return drive;
}

}  // namespace

std::vector<std::uint64_t> seeds_of(const ExperimentExtent& extent) {
  std::vector<std::uint64_t> seeds(static_cast<std::size_t>(extent.seeds));
  std::iota(seeds.begin(), seeds.end(), static_cast<std::uint64_t>(extent.first_seed));
  return seeds;
}

PublishedExperiment lusnar_experiment(const fs::path& configs, const ExperimentExtent& extent) {
  PublishedExperiment e{
      {.name = "lusnar", .title = "Nine LuSNAR-like scenes", .variants = usual_variants(), .seeds = seeds_of(extent)}};
  e.study.variants.push_back(on_lidar("published_lidar", as(published_factors())));
  e.study.variants.push_back(on_lidar("default_lidar", SlamOptions()));
  constexpr std::array<double, 9> vo_rpe{0.0020, 0.0017, 0.036, 0.0016, 0.0021, 0.0017, 0.0015, 0.0018, 0.0019},
      vo_ate{0.0039, 0.0048, 0.0042, 0.0057, 0.0073, 0.0107, 0.0045, 0.0079, 0.0073},
      dem_ate{0.0010, 0.0012, 0.0036, 0.0021, 0.0023, 0.0010, 0.0021, 0.0069, 0.0004};
  for (std::size_t i = 0; i < 9; ++i) {
    const std::string name = fmt::format("scene_{}", i + 1);
    e.study.drives.push_back(drive_of(name, configs / fmt::format("lusnar_{}.toml", i + 1), extent));
    e.published.push_back({.drive = name, .variant = "odometry", .ate_star = vo_ate[i], .rpe_m = vo_rpe[i]});
    e.published.push_back({.drive = name, .variant = "published_lidar", .ate_star = dem_ate[i], .rpe_m = vo_rpe[i]});
  }
  return e;
}

PublishedExperiment crater_experiment(const fs::path& configs, const ExperimentExtent& extent) {
  return {{.name = "crater",
           .title = "A loop of 1.03 km around a crater rim",
           .drives = {drive_of("crater_loop", configs / "crater_loop_1030m.toml", extent)},
           .variants = {{"odometry", without_loops(as(odometry_only()))},
                        {"loop", as(odometry_only())},
                        {"published", without_loops(as(published_factors()))},
                        {"published_loop", as(published_factors())},
                        {"default", without_loops(SlamOptions())},
                        {"default_loop", SlamOptions()}},
           .seeds = seeds_of(extent)},
          {{.drive = "crater_loop", .variant = "loop", .ate_m = 94.01},
           {.drive = "crater_loop", .variant = "published_loop", .ate_m = 21.43}}};
}

PublishedExperiment traverse_experiment(const fs::path& configs, const ExperimentExtent& extent) {
  return {{.name = "traverse",
           .title = "A traverse of 1.19 km",
           .drives = {drive_of("traverse", configs / "traverse_1190m.toml", extent)},
           .variants = usual_variants(),
           .seeds = seeds_of(extent)},
          {{.drive = "traverse", .variant = "odometry", .ate_m = 78.0, .rpe_m = 0.017},
           {.drive = "traverse", .variant = "published", .ate_m = 7.71, .rpe_m = 0.020}}};
}

PublishedExperiment longrange_experiment(const fs::path& configs, const ExperimentExtent& extent) {
  StudyDrive drive = drive_of("polar", configs / "polar_11km.toml", extent);
  drive.scene.output.imu = drive.scene.output.wheels = drive.scene.output.sun = true;
  SlamOptions odometry, sun, dem;
  odometry.use_dem = odometry.use_sun = odometry.use_loops = false;
  sun.use_dem = false;
  dem.use_sun = false;
  return {{.name = "longrange",
           .title = "Eleven kilometres",
           .drives = {drive},
           .variants = {{"odometry", odometry}, {"sun", sun}, {"dem", dem}, {"default", SlamOptions()}},
           .seeds = seeds_of(extent)},
          {}};
}

PublishedExperiment uncertainty_experiment(const fs::path& configs, const ExperimentExtent& extent) {
  struct Case {
    const char* name;
    Perturbation perturbation;
    double ate_m, drift_percent;
  };
  const std::array<Case, 9> cases{{{"dem", {}, 0.672, 0.717},
                                   {"noise_0.5m", {.noise_m = {.rms = 0.5}}, 0.658, 0.677},
                                   {"noise_1m", {.noise_m = {.rms = 1.0}}, 0.894, 0.898},
                                   {"noise_2m", {.noise_m = {.rms = 2.0}}, 0.671, 0.536},
                                   {"bias_0.5m", {.bias_m = 0.5}, 0.680, 0.750},
                                   {"bias_1m", {.bias_m = 1.0}, 0.712, 0.801},
                                   {"shift_0.5m", {.shift_m = {0.5, 0.0}}, 0.698, 0.741},
                                   {"shift_1m", {.shift_m = {1.0, 0.0}}, 0.723, 0.770},
                                   {"shift_2m", {.shift_m = {2.0, 0.0}}, 0.837, 0.927}}};
  PublishedExperiment e{{.name = "uncertainty",
                         .title = "378 m with errors of the DEM",
                         .drives = {drive_of("traverse", configs / "traverse_378m.toml", extent)},
                         .variants = {{"no_dem", without_loops(as(odometry_only()))}},
                         .seeds = seeds_of(extent)},
                        {{.drive = "traverse", .variant = "no_dem", .ate_m = 0.788, .drift_percent = 0.986}}};
  for (const Case& c : cases) {
    SlamOptions declared;  // the mission knows its map's noise, not its bias or shift
    declared.anchoring.sigma_dem_m = std::max(0.1, c.perturbation.noise_m.rms);
    e.study.variants.push_back({c.name, declared, StudyDem::ground, c.perturbation});
    e.published.push_back({.drive = "traverse", .variant = c.name, .ate_m = c.ate_m, .drift_percent = c.drift_percent});
  }
  return e;
}

std::vector<StudyDrive> short_drives(const fs::path& configs, const ExperimentExtent& extent) {
  std::vector<StudyDrive> drives;
  for (const char* preset : {"highland_300m", "crater_rim_300m", "mare_300m"}) {
    drives.push_back(drive_of(preset, configs / fmt::format("{}.toml", preset), extent));
  }
  return drives;
}

PublishedExperiment anchoring_experiment(const fs::path& configs, const ExperimentExtent& extent, const fs::path& nac) {
  Study study{.name = "anchoring",
              .title = "Ways of anchoring, with images",
              .drives = short_drives(configs, extent),
              .seeds = seeds_of(extent)};
  if (!nac.empty()) {
    study.drives.push_back(drive_of("nac_traverse", configs / "nac_traverse.toml", extent));
    study.drives.back().scene.terrain.dem = fs::absolute(nac);
  }
  study.variants = usual_variants();
  study.variants.push_back({"patches", as(filtered_patches())});
  study.variants.push_back({"submaps", as(submaps())});
  study.variants.push_back({"all", as(everything())});
  return {study, {}};
}

}  // namespace demslam

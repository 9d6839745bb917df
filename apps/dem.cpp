#include "demslam/dem/dem.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dem/compare.h"
#include "demslam/dem/dem_reader.h"
#include "demslam/dem/perturb.h"
#include "demslam/dem/reproject.h"
#include "demslam/dem/statistics.h"
#include "demslam/mapping/build_dem.h"
#include "progress_bar.h"
#include "truth_options.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json info_json(const fs::path& file, const DemRaster& dem, const DemStatistics& stats) {
  return {{"file", file.string()},
          {"columns", dem.cols},
          {"rows", dem.rows},
          {"cell_m", dem.cell_m},
          {"west_m", dem.frame.origin.x() + dem.west_m},
          {"north_m", dem.frame.origin.y() + dem.north_m},
          {"map_origin_m", {dem.frame.origin.x(), dem.frame.origin.y(), dem.frame.origin.z()}},
          {"min_m", stats.min_m},
          {"max_m", stats.max_m},
          {"mean_m", stats.mean_m},
          {"slope_median_deg", stats.slope_median_deg},
          {"slope_p95_deg", stats.slope_p95_deg},
          {"holes", stats.holes},
          {"hole_fraction", stats.hole_fraction()},
          {"heights_from", name_of(dem.frame.heights)},
          {"crs_wkt", dem.frame.crs_wkt}};
}

void info(const fs::path& file, const std::optional<fs::path>& json) {
  const DemRaster dem = DemReader(file).grid();
  const DemStatistics stats = statistics(file);
  const Eigen::Vector3d& origin = dem.frame.origin;
  fmt::print("{}\n  size      {} x {} cells of {:g} m ({:.2f} x {:.2f} km)\n", file.string(), dem.cols, dem.rows,
             dem.cell_m, dem.cols * dem.cell_m * 1e-3, dem.rows * dem.cell_m * 1e-3);
  fmt::print("  heights   {:.5f} to {:.5f} m, mean {:.3f} m, counted from: {}\n", stats.min_m, stats.max_m,
             stats.mean_m, name_of(dem.frame.heights));
  fmt::print("  slope     median {:.1f} deg, 95 % below {:.1f} deg\n", stats.slope_median_deg, stats.slope_p95_deg);
  fmt::print("  holes     {} cells ({:.2f} %)\n", stats.holes, 100.0 * stats.hole_fraction());
  fmt::print("  map origin  easting {:.3f}, northing {:.3f}, height {:.3f} m\n", origin.x(), origin.y(), origin.z());
  if (dem.frame.crs_wkt.empty()) {
    fmt::print("  CRS       none: metres are taken on the user's word\n");
  } else {
    const Eigen::Vector3d centre = Georeference(dem.frame).lon_lat_height(Eigen::Vector3d::Zero());
    fmt::print("  CRS       origin at longitude {:.6f}, latitude {:.6f}, height {:.3f} m\n", centre.x(), centre.y(),
               centre.z());
  }
  if (json) write_text(*json, info_json(file, dem, stats).dump(1) + "\n");
}

struct CropArguments {
  fs::path input, output;
  std::vector<double> centre_deg, window_m;
  LocalCut cut;
  std::optional<HeightDatum> heights;
  std::optional<double> geoid_undulation_m;
};

DemRaster cut_out(const CropArguments& a) {
  if (a.centre_deg.size() == 2) {
    return read_dem_around(a.input, {a.centre_deg[0], a.centre_deg[1], a.cut.radius_m, a.cut.cell_m});
  }
  if (a.window_m.size() == 4) {
    return read_dem(a.input, MapWindow{a.window_m[0], a.window_m[1], a.window_m[2], a.window_m[3]});
  }
  if (a.heights) return read_dem(a.input);
  throw Error(
      "dem crop: say what to cut: --center LON LAT --radius-m R, or --window WEST SOUTH EAST NORTH (map metres); or "
      "with --heights alone keep it whole");
}

void crop_dem(const CropArguments& a) {
  if (a.geoid_undulation_m && !a.heights) throw Error("dem crop: --geoid-undulation-m goes with --heights geoid");
  DemRaster dem = cut_out(a);
  if (a.heights) dem.frame = with_heights(dem.frame, *a.heights, a.geoid_undulation_m);
  write_dem(a.output, dem);
  fmt::print("{}: written, {} x {} cells of {:g} m, heights from: {}\n", a.output.string(), dem.cols, dem.rows,
             dem.cell_m, name_of(dem.frame.heights));
}

struct PerturbArguments {
  fs::path input, output;
  Perturbation perturbation;
  std::vector<double> shift_m;
};

void perturb_dem(PerturbArguments a) {
  if (a.shift_m.size() == 2) a.perturbation.shift_m = {a.shift_m[0], a.shift_m[1]};
  write_dem(a.output, perturb(read_dem(a.input), a.perturbation));
  fmt::print("{}: written\n", a.output.string());
}

struct BuildArguments {
  BuildDemInputs inputs;
  DemBuildOptions options;
  fs::path output;
  std::vector<double> sensor_m;
  std::optional<fs::path> json;
};

Json build_json(const BuildArguments& a, const DemBuildReport& report) {
  const BuiltDem& dem = report.dem;
  return {{"file", a.output.string()},
          {"poses", a.inputs.poses.string()},
          {"scans", report.scans},
          {"scans_without_pose", report.without_pose},
          {"world_z_down", report.world_z_down},
          {"points", dem.points},
          {"columns", dem.heights.cols},
          {"rows", dem.heights.rows},
          {"cell_m", dem.heights.cell_m},
          {"filled", dem.filled},
          {"hole_fraction", dem.hole_fraction()}};
}

void build(BuildArguments a) {
  if (a.sensor_m.size() == 3) a.inputs.p_body_sensor = Eigen::Vector3d(a.sensor_m.data());
  ProgressBar bar("dem build", "scans");
  const DemBuildReport report = build_dem(a.inputs, a.options, bar.progress());
  write_built_dem(a.output, report.dem);
  fmt::print("{}: {} points of {} scans in {} x {} cells of {:g} m, {:.1f} % holes; _sigma and _count beside it\n",
             a.output.string(), report.dem.points, report.scans, report.dem.heights.cols, report.dem.heights.rows,
             report.dem.heights.cell_m, 100.0 * report.dem.hole_fraction());
  if (!a.inputs.poses.empty()) fmt::print("  poses: {}\n", a.inputs.poses.string());
  if (report.without_pose > 0) fmt::print("  {} scans have no pose and are left out\n", report.without_pose);
  if (report.world_z_down) fmt::print("  the world's z points down (points lie above the sensor): turned about x\n");
  if (a.json) write_text(*a.json, build_json(a, report).dump(1) + "\n");
}

struct CompareArguments {
  fs::path a, b;
  std::optional<fs::path> output, json;
};

Json compare_json(const CompareArguments& files, const DemComparison& c) {
  return {{"a", files.a.string()},  {"b", files.b.string()}, {"cells", c.cells},    {"mean_m", c.mean_m},
          {"median_m", c.median_m}, {"rms_m", c.rms_m},      {"std_m", c.std_m},    {"nmad_m", c.nmad_m},
          {"min_m", c.min_m},       {"max_m", c.max_m},      {"p95_abs_m", c.p95_m}};
}

void compare(const CompareArguments& files) {
  const DemComparison c = compare_dems(files.a, files.b);
  fmt::print("{} - {}: {} cells\n", files.a.string(), files.b.string(), c.cells);
  fmt::print("  mean {:+.4f} m, median {:+.4f} m, RMS {:.4f} m, standard deviation {:.4f} m, NMAD {:.4f} m\n", c.mean_m,
             c.median_m, c.rms_m, c.std_m, c.nmad_m);
  fmt::print("  {:+.4f} to {:+.4f} m, 95 % within {:.4f} m\n", c.min_m, c.max_m, c.p95_m);
  if (files.output) write_dem(*files.output, c.difference);
  if (files.json) write_text(*files.json, compare_json(files, c).dump(1) + "\n");
}

void add_build(CLI::App& dem) {
  static const std::map<std::string, CloudKind> kinds{
      {"lidar", CloudKind::lidar}, {"depth", CloudKind::depth}, {"points", CloudKind::points}};
  auto a = std::make_shared<BuildArguments>();
  CLI::App* command = dem.add_subcommand("build", "rasterise LiDAR scans, depth images or points, with their poses");
  command->add_option("source", a->inputs.source, "dataset folder, or point file (PLY, x y z) in the map frame")
      ->required();
  command->add_option("--from", a->inputs.kind, "lidar, depth or points")
      ->transform(CLI::CheckedTransformer(kinds).description("NAME"));
  command->add_option("--poses", a->inputs.poses,
                      "where the poses come from: lidar: the sensor's (LiDAR/timestamp.txt); depth: the body's");
  command->add_option("--sensor-in-body", a->sensor_m, "lidar: --poses are the body's, the sensor sits there, level")
      ->expected(3);
  command->add_option("-o,--output", a->output, "GeoTIFF to write; NAME_sigma.tif and NAME_count.tif beside it")
      ->required();
  command->add_option("--cell-m", a->options.cell_m, "cell size");
  command->add_option("--min-points", a->options.min_points, "cells with fewer are holes");
  command->add_option("--sigma-pose-m", a->options.sigma_pose_m, "vertical error of the poses");
  command->add_option("--max-range-m", a->inputs.max_range_m, "points further from the sensor are left out");
  command->add_option("--pixel-step", a->inputs.pixel_step, "depth: every so many columns and rows");
  command->add_flag("--without-rocks", a->inputs.without_rocks, "lidar: leave out what is labelled rock (174)");
  command->add_option("--like", a->inputs.like, "a DEM whose CRS and map origin the poses are in");
  command->add_option("--calibration", a->inputs.calibration, "depth: calibration, replaces the dataset's own");
  command->add_option("--json", a->json, "also write the figures as JSON");
  command->footer(
      "Example:\n  demslam dem build Moon_1 --from lidar --poses Moon_1/LiDAR/timestamp.txt --cell-m 1 -o dem.tif");
  command->callback([a] { build(*a); });
}

void add_compare(CLI::App& dem) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* command = dem.add_subcommand("compare", "statistics and raster of the difference A - B");
  command->add_option("a", a->a, "any GDAL raster")->required();
  command->add_option("b", a->b, "another one in the same CRS")->required();
  command->add_option("-o,--output", a->output, "GeoTIFF of the difference on A's grid");
  command->add_option("--json", a->json, "also write the figures as JSON");
  command->footer("Example:\n  demslam dem compare dem.tif worse.tif -o difference.tif");
  command->callback([a] { compare(*a); });
}

void add_info(CLI::App& dem) {
  auto file = std::make_shared<fs::path>();
  auto json = std::make_shared<std::optional<fs::path>>();
  CLI::App* command = dem.add_subcommand("info", "size, heights, slopes, holes, CRS");
  command->add_option("dem", *file, "any GDAL raster")->required();
  command->add_option("--json", *json, "also write the figures as JSON");
  command->footer("Example:\n  demslam dem info dem.tif");
  command->callback([=] { info(*file, *json); });
}

void add_crop(CLI::App& dem) {
  auto a = std::make_shared<CropArguments>();
  CLI::App* command =
      dem.add_subcommand("crop", "cut a part; geographic rasters are reprojected to metres around the centre");
  command->add_option("dem", a->input, "any GDAL raster")->required();
  command->add_option("-o,--output", a->output, "GeoTIFF to write")->required();
  command->add_option("--center", a->centre_deg, "longitude and latitude, degrees")->expected(2);
  command->add_option("--radius-m", a->cut.radius_m, "half the side of what is cut around the centre");
  command->add_option("--cell-m", a->cut.cell_m, "cell size of the result, with --center");
  command->add_option("--window", a->window_m, "west south east north in map metres")->expected(4);
  add_datum_option(*command, "--heights", a->heights,
                   "what the file's heights count from: radius (becomes sphere), sphere, ellipsoid or geoid");
  command->add_option("--geoid-undulation-m", a->geoid_undulation_m,
                      "with --heights geoid: geoid above the ellipsoid there; the heights become ellipsoidal");
  command->footer(
      "Example:\n  demslam dem crop LDEM_4.LBL --center 25.6 45.0 --radius-m 60000 --heights radius -o crop.tif");
  command->callback([a] { crop_dem(*a); });
}

void add_perturb(CLI::App& dem) {
  auto a = std::make_shared<PerturbArguments>();
  CLI::App* command = dem.add_subcommand("perturb", "add correlated noise, a bias, a shift");
  command->add_option("dem", a->input, "any GDAL raster")->required();
  command->add_option("-o,--output", a->output, "GeoTIFF to write")->required();
  command->add_option("--noise-rms-m", a->perturbation.noise_m.rms, "RMS of a Gaussian random field");
  command->add_option("--correlation-m", a->perturbation.noise_m.correlation_length_m, "its correlation length");
  command->add_option("--seed", a->perturbation.noise_m.seed, "its seed");
  command->add_option("--bias-m", a->perturbation.bias_m, "added to every height");
  command->add_option("--shift-m", a->shift_m, "east and north, the terrain moves by this much")->expected(2);
  command->footer("Example:\n  demslam dem perturb dem.tif --noise-rms-m 1 --shift-m 2 0 -o worse.tif");
  command->callback([a] { perturb_dem(*a); });
}

}  // namespace

void add_dem(CLI::App& app) {
  CLI::App* command = app.add_subcommand("dem", "inspect, cut, build, perturb and compare elevation models");
  command->require_subcommand(1);
  add_info(*command);
  add_crop(*command);
  add_build(*command);
  add_perturb(*command);
  add_compare(*command);
  add_dem_observability(*command);
}

}  // namespace demslam::apps

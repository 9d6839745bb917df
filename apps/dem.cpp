#include "demslam/dem/dem.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "demslam/base/text.h"
#include "demslam/base/error.h"
#include "demslam/dem/perturb.h"
#include "demslam/dem/reproject.h"
#include "demslam/dem/statistics.h"

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
          {"crs_wkt", dem.frame.crs_wkt}};
}

void info(const fs::path& file, const std::optional<fs::path>& json) {
  const DemRaster dem = read_dem(file);
  const DemStatistics stats = statistics(dem);
  const Eigen::Vector3d& origin = dem.frame.origin;
  fmt::print("{}\n  size      {} x {} cells of {:g} m ({:.2f} x {:.2f} km)\n", file.string(), dem.cols, dem.rows,
             dem.cell_m, dem.cols * dem.cell_m * 1e-3, dem.rows * dem.cell_m * 1e-3);
  fmt::print("  heights   {:.5f} to {:.5f} m, mean {:.3f} m\n", stats.min_m, stats.max_m, stats.mean_m);
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
};

void crop_dem(const CropArguments& a) {
  if (a.centre_deg.size() == 2) {
    const LocalCut cut{a.centre_deg[0], a.centre_deg[1], a.cut.radius_m, a.cut.cell_m};
    write_dem(a.output, read_dem_around(a.input, cut));
  } else if (a.window_m.size() == 4) {
    write_dem(a.output, crop(read_dem(a.input), {a.window_m[0], a.window_m[1], a.window_m[2], a.window_m[3]}));
  } else {
    throw Error(
        "dem crop: say what to cut: --center LON LAT --radius-m R, or --window WEST SOUTH EAST NORTH (map metres)");
  }
  fmt::print("{}: written\n", a.output.string());
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
  command->footer("Example:\n  demslam dem crop LDEM_4.LBL --center 25.6 45.0 --radius-m 60000 -o crop.tif");
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
  CLI::App* command = app.add_subcommand("dem", "inspect, cut and perturb elevation models");
  command->require_subcommand(1);
  add_info(*command);
  add_crop(*command);
  add_perturb(*command);
  add_dem_observability(*command);
}

}  // namespace demslam::apps

#include "demslam/anchoring/observability.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "progress_bar.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  fs::path dem, route, output;
  bool lon_lat = false;
  ObservabilityOptions options;
};

/// Horizontal positions of a route file: TUM (t x y z qx qy qz qw), or x and y, or longitude and latitude.
std::vector<Eigen::Vector2d> read_route(const Arguments& a, const LocalFrame& frame) {
  const TextTable table = read_table(a.route);
  std::vector<Eigen::Vector2d> route;
  std::optional<Georeference> georeference;
  if (a.lon_lat) georeference.emplace(frame);
  for (const TextRow& row : table.rows) {
    const std::size_t first = row.fields.size() >= 8 ? 1 : 0;
    const Eigen::Vector2d p(table.number(row, first), table.number(row, first + 1));
    route.push_back(georeference ? georeference->map_from_lon_lat_height({p.x(), p.y(), 0.0}).head<2>() : p);
  }
  return route;
}

std::string csv_of(const std::vector<PredictedPose>& poses) {
  std::string text =
      "path_m,x_m,y_m,on_dem,sigma_horizontal_m,sigma_vertical_m,sigma_heading_deg,sigma_horizontal_after_m,"
      "sigma_horizontal_odometry_m\n";
  for (const PredictedPose& p : poses) {
    text += fmt::format("{:.1f},{:.2f},{:.2f},{:d},{:.3f},{:.3f},{:.4f},{:.3f},{:.3f}\n", p.path_m, p.position_m.x(),
                        p.position_m.y(), p.on_dem, p.horizontal_m, p.vertical_m, p.heading_deg, p.horizontal_after_m,
                        p.odometry_horizontal_m);
  }
  return text;
}

std::string json_of(const std::vector<PredictedPose>& poses) {
  Json all = Json::array();
  for (const PredictedPose& p : poses) {
    all.push_back({{"path_m", p.path_m},
                   {"x_m", p.position_m.x()},
                   {"y_m", p.position_m.y()},
                   {"on_dem", p.on_dem},
                   {"sigma_horizontal_m", p.horizontal_m},
                   {"sigma_vertical_m", p.vertical_m},
                   {"sigma_heading_deg", p.heading_deg},
                   {"sigma_horizontal_after_m", p.horizontal_after_m},
                   {"sigma_horizontal_odometry_m", p.odometry_horizontal_m}});
  }
  return all.dump(1) + "\n";
}

void print_summary(const std::vector<PredictedPose>& poses, const fs::path& output) {
  const auto worst = std::max_element(poses.begin(), poses.end(), [](const PredictedPose& a, const PredictedPose& b) {
    return a.horizontal_m < b.horizontal_m;
  });
  const PredictedPose& end = poses.back();
  fmt::print("route     {:.0f} m\n", end.path_m);
  fmt::print("at the end   {:.2f} m horizontal, {:.2f} m vertical, {:.2f} deg heading (odometry alone {:.2f} m)\n",
             end.horizontal_m, end.vertical_m, end.heading_deg, end.odometry_horizontal_m);
  fmt::print("worst        {:.2f} m horizontal after {:.0f} m\n", worst->horizontal_m, worst->path_m);
  fmt::print("afterwards   {:.2f} m at the end, when the whole drive is known\n", end.horizontal_after_m);
  fmt::print("{}: route.csv, route.json, sigma.tif\n", output.string());
}

void run(const Arguments& a) {
  const auto dem = std::make_shared<const Dem>(read_dem(a.dem));
  const std::vector<Eigen::Vector2d> route = read_route(a, dem->raster().frame);
  std::error_code failure;
  fs::create_directories(a.output, failure);
  if (failure) throw Error(a.output.string() + ": cannot be made: " + failure.message());
  ProgressBar along("route", "poses");
  const std::vector<PredictedPose> poses = predict_along(route, dem, a.options, along.progress());
  write_text(a.output / "route.csv", csv_of(poses));
  write_text(a.output / "route.json", json_of(poses));
  ProgressBar over("map", "rows");
  write_dem(a.output / "sigma.tif", predicted_sigma(*dem, a.options, over.progress()));
  if (!poses.empty()) print_summary(poses, a.output);
}

}  // namespace

void add_dem_observability(CLI::App& dem) {
  auto a = std::make_shared<Arguments>();
  a->options.anchoring.filter_dem = true;
  CLI::App* command =
      dem.add_subcommand("observability", "predicted position uncertainty along a route, before driving it");
  command->add_option("dem", a->dem, "any GDAL raster in metres")->required();
  command->add_option("route", a->route, "TUM trajectory, or x and y in map metres, one point a line")->required();
  command->add_option("-o,--output", a->output, "folder for route.csv, route.json and sigma.tif")->required();
  command->add_flag("--lonlat", a->lon_lat, "the route is longitude and latitude, degrees");
  command->add_option("--sigma-dem-m", a->options.anchoring.sigma_dem_m, "the DEM's vertical error");
  command->add_option("--correlation-m", a->options.anchoring.dem_correlation_m, "its correlation length");
  command->add_option("--start-sigma-m", a->options.start_sigma_m, "how well the start is known");
  command->add_option("--rotation-deg-per-sqrt-m", a->options.rotation_deg_per_sqrt_m, "odometry's random walk");
  command->add_option("--translation-m-per-sqrt-m", a->options.translation_m_per_sqrt_m, "odometry's random walk");
  command->add_option("--cell-m", a->options.information_cell_m, "cells of sigma.tif");
  command->footer(
      "Example:\n  demslam dem observability runs/data/dem.tif runs/anchored/trajectory.tum -o runs/prediction");
  command->callback([a] { run(*a); });
}

}  // namespace demslam::apps

#include <algorithm>
#include <cmath>

#include "demslam/base/version.h"
#include "demslam/report/internal/packed.h"
#include "demslam/report/internal/run_json.h"
#include "demslam/report/report_page.h"
#include "demslam/report/terrain_grid.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

/// Heights in 65534 steps between the lowest and the highest; 65535 is no data.
Json terrain_json(const TerrainGrid& grid, const std::filesystem::path& file) {
  float low = INFINITY, high = -INFINITY;
  for (const float height : grid.heights_m) {
    if (std::isnan(height)) continue;
    low = std::min(low, height);
    high = std::max(high, height);
  }
  if (low > high) return nullptr;
  const float step = std::max((high - low) / 65534.0F, 1e-9F);
  std::vector<std::uint16_t> steps;
  for (const float height : grid.heights_m) {
    steps.push_back(std::isnan(height) ? 65535 : static_cast<std::uint16_t>(std::lround((height - low) / step)));
  }
  return {{"file", file.filename().string()},
          {"rows", grid.rows},
          {"cols", grid.cols},
          {"step_m", grid.step_m},
          {"west_m", grid.west_m},
          {"north_m", grid.north_m},
          {"low_m", low},
          {"height_step_m", step},
          {"heights", packed(std::span<const std::uint16_t>(steps))}};
}

Eigen::AlignedBox2d ground_of(const Report& report) {
  Eigen::AlignedBox2d box;
  const auto extend = [&](const Trajectory& trajectory) {
    for (const StampedPose& stamped : trajectory) box.extend(stamped.pose.translation().head<2>());
  };
  for (const ReportRun& run : report.runs) extend(run.trajectory);
  if (report.truth) extend(*report.truth);
  return box;
}

/// A box that keeps its place while what is in it grows, but for a few leaps.
Eigen::AlignedBox2d grown(const Eigen::AlignedBox2d& box) {
  if (box.isEmpty()) return box;
  const double side = std::exp2(std::ceil(std::log2(std::max(box.sizes().maxCoeff(), 20.0))));
  const Eigen::Array2d step = Eigen::Array2d::Constant(0.5 * side);
  const auto below = [&](const Eigen::Array2d& p) {
    return ((p / step + 0.5).floor() - 0.5) * step;
  };  // the start is inside
  return {below(box.min().array()).matrix(), (below(box.max().array()) + step).matrix()};
}

Json truth_json(const Trajectory& truth, std::size_t max_points) {
  Columns columns{{"x_m", {}}, {"y_m", {}}, {"z_m", {}}};
  for (const StampedPose& stamped : truth) {
    for (int k = 0; k < 3; ++k) columns[k].values.push_back(static_cast<float>(stamped.pose.translation()[k]));
  }
  return packed(thinned(columns, max_points));
}

PageOptions share_of(PageOptions options, std::size_t runs) {
  const auto divide = [&](std::size_t& value) { value = (value + runs - 1) / runs; };
  for (std::size_t* value : {&options.images, &options.rows, &options.track_points}) divide(*value);
  return options;
}

/// Text that cannot end the <script> it stands in.
std::string script_safe(const std::string& json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

}  // namespace

std::string page_data(const Report& report, const PageOptions& options, ImageCache* cache) {
  std::vector<std::string> notes = report.notes;
  std::optional<Dem> dem;
  if (report.dem)
    dem.emplace(read_dem(*report.dem));
  else
    notes.push_back("no run names a DEM: no terrain");
  if (!report.truth) notes.push_back("no ground truth found: no errors");
  Json json = {{"demslam", kVersion}, {"terrain", nullptr}, {"truth", nullptr}};
  if (options.live) json["live"] = "events";
  if (dem) {
    const Eigen::AlignedBox2d ground = options.live ? grown(ground_of(report)) : ground_of(report);
    const auto grid = terrain_around(*dem, ground, options.terrain_side);
    if (grid) json["terrain"] = terrain_json(*grid, *report.dem);
  }
  if (report.truth) json["truth"] = truth_json(*report.truth, options.track_points);
  ImageTable images(options, cache);
  const PageContext context{share_of(options, std::max<std::size_t>(report.runs.size(), 1)), dem ? &*dem : nullptr,
                            &images, &notes};
  for (const ReportRun& run : report.runs) json["runs"].push_back(run_json(run, context));
  json["images"] = images.take();
  json["notes"] = notes;
  return script_safe(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace demslam

#include "demslam/evaluation/truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/dem/dem.h"
#include "demslam/evaluation/geodetic_track.h"
#include "demslam/evaluation/lusnar_truth.h"

namespace demslam {
namespace {

constexpr double kWgs84SemiMajor_m = 6378137.0;

/// The undulation to take off ellipsoidal heights, so that they count from where the DEM's do.
double undulation_m(const HeightDatum& datum, const TruthOptions& options, const std::string& dem) {
  if (datum == HeightDatum::unstated) {
    throw Error(dem +
                " does not say what its heights count from, so heights above the ellipsoid cannot be compared with "
                "them; pass --dem-heights ellipsoid (or sphere, radius), or geoid with --geoid-undulation-m");
  }
  if (datum != HeightDatum::geoid) {
    if (options.geoid_undulation_m) {
      throw Error(dem + ": its heights count from the " + std::string(name_of(datum)) + ", not from a geoid");
    }
    return 0.0;
  }
  if (options.geoid_undulation_m) return *options.geoid_undulation_m;
  throw Error(dem + ": its heights count from a geoid; pass --geoid-undulation-m (geoid above the ellipsoid there)");
}

/// A frame in which heights above the body's ellipsoid are heights.
LocalFrame frame_above_ellipsoid(LocalFrame frame, HeightDatum datum) {
  return datum == HeightDatum::radius ? with_heights(std::move(frame), datum, std::nullopt) : frame;
}

void check_body(const LocalFrame& frame, const std::filesystem::path& truth, const std::string& dem) {
  const double semi_major_m = semi_major_axis_m(frame);
  if (std::abs(semi_major_m - kWgs84SemiMajor_m) < 10.0) return;
  throw Error(truth.string() + ": satellite navigation is on Earth (WGS84), but " + dem +
              fmt::format(" is on a body of {:.0f} m", semi_major_m));
}

/// Median height of the truth above the terrain; nothing where they do not meet.
std::optional<double> height_above(const Dem& dem, const Trajectory& truth) {
  std::vector<double> heights;
  for (const StampedPose& stamped : truth) {
    const Eigen::Vector3d& p = stamped.pose.translation();
    if (const auto terrain = dem.height(p.x(), p.y())) heights.push_back(p.z() - *terrain);
  }
  if (heights.empty()) return std::nullopt;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

Truth geodetic_truth(const std::filesystem::path& file, const TruthOptions& options) {
  if (!options.dem) throw Error(file.string() + ": longitude and latitude need a DEM's map to go to; pass --dem FILE");
  const std::string dem_name = options.dem->string();
  const Dem dem = open_dem(*options.dem);
  const LocalFrame& frame = dem.raster().frame;
  const GeodeticFile geodetic = read_geodetic(file);
  if (geodetic.wgs84) check_body(frame, file, dem_name);
  const HeightDatum datum = options.dem_heights.value_or(frame.heights);
  const double lowered_m = undulation_m(datum, options, dem_name);
  const Georeference georeference(frame_above_ellipsoid(frame, datum));

  Truth truth;
  truth.file.poses = positions_in_map(geodetic.fixes, georeference, {options.worst_quality, lowered_m});
  truth.notes.push_back(fmt::format("truth: {} of {} fixes, in the map of {}, whose heights count from the {}{}",
                                    truth.file.poses.size(), geodetic.fixes.size(), dem_name, name_of(datum),
                                    lowered_m == 0.0 ? "" : fmt::format(" {:g} m above the ellipsoid", lowered_m)));
  if (const auto above_m = height_above(dem, truth.file.poses)) {
    truth.notes.push_back(fmt::format(
        "truth: lies {:.2f} m above the DEM (median): the height of what it measures, and what is left of the datums",
        *above_m));
  } else {
    truth.notes.push_back("truth: lies nowhere on the DEM");
  }
  return truth;
}

}  // namespace

Truth read_truth(const std::filesystem::path& file, const TruthOptions& options) {
  if (is_geodetic(file)) return geodetic_truth(file, options);
  Truth truth{read_trajectory(file), {}};
  if (is_lusnar_truth(file)) truth.file.poses = lusnar_T_map_body(truth.file.poses);
  return truth;
}

TrajectoryFile read_truth(const std::filesystem::path& file) { return read_truth(file, {}).file; }

}  // namespace demslam

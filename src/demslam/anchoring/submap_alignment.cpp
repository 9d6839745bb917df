#include "demslam/anchoring/submap_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "demslam/geometry/angle.h"
#include "demslam/geometry/covariance.h"

namespace demslam {
namespace {

constexpr std::size_t kRefined = 40;  // places looked at closely

SearchWindow window_of(const Pose& T_map_body, const Matrix6d& covariance, const SubmapOptions& o) {
  return {.radius_m =
              std::clamp(o.window_sigmas * horizontal_sigma_m(T_map_body, covariance), o.min_window_m, o.max_window_m),
          .step_m = o.step_m,
          .heading_rad = std::clamp(o.window_sigmas * heading_sigma_rad(T_map_body, covariance),
                                    o.min_window_deg * kRadPerDeg, o.max_window_deg * kRadPerDeg)};
}

double distance_m(const TerrainMatch& a, const TerrainMatch& b) {
  return (a.T_map_body.translation() - b.T_map_body.translation()).head<2>().norm();
}

bool better(const TerrainMatch& a, const TerrainMatch& b) { return a.chi_square < b.chi_square; }

/// The best places, none next to a better one.
std::vector<TerrainMatch> peaks(const std::vector<TerrainMatch>& sorted, double apart_m) {
  std::vector<TerrainMatch> chosen;
  for (const TerrainMatch& place : sorted) {
    const bool near = std::any_of(chosen.begin(), chosen.end(),
                                  [&](const TerrainMatch& other) { return distance_m(place, other) < apart_m; });
    if (!near) chosen.push_back(place);
    if (chosen.size() == kRefined) break;
  }
  return chosen;
}

/// Chi-square of the best place at least `apart_m` away, be it a peak or the flank of one.
double second_best(const TerrainMatch& best, const std::vector<TerrainMatch>& places, double apart_m) {
  double second = std::numeric_limits<double>::infinity();
  for (const TerrainMatch& place : places) {
    if (distance_m(place, best) >= apart_m) second = std::min(second, place.chi_square);
  }
  return second;
}

/// The scanned place that lies nearest to where the refinement ended.
const TerrainMatch& nearest(const std::vector<TerrainMatch>& scanned, const TerrainMatch& best) {
  return *std::min_element(scanned.begin(), scanned.end(), [&](const TerrainMatch& a, const TerrainMatch& b) {
    return distance_m(a, best) < distance_m(b, best);
  });
}

FixStatus verdict(const TerrainFix& fix, bool at_edge, const FixAcceptance& a) {
  const auto cells = static_cast<double>(fix.cells);
  if (at_edge) return FixStatus::at_window_edge;
  if (fix.second_chi_square - fix.chi_square < a.peak_chi_square) return FixStatus::ambiguous;
  if (fix.chi_square > a.max_misfit * cells) return FixStatus::misfit;
  if (horizontal_sigma_m(fix.T_map_body, fix.covariance) > a.max_sigma_m) return FixStatus::too_vague;
  return FixStatus::accepted;
}

}  // namespace

std::string to_string(FixStatus status) {
  switch (status) {
    case FixStatus::accepted:
      return "accepted";
    case FixStatus::too_little_ground:
      return "too little ground";
    case FixStatus::off_the_dem:
      return "off the DEM";
    case FixStatus::at_window_edge:
      return "at the window's edge";
    case FixStatus::ambiguous:
      return "ambiguous";
    case FixStatus::misfit:
      return "misfit";
    case FixStatus::too_vague:
      return "too vague";
  }
  return "";
}

TerrainFix judged(const TerrainSearch& search, std::vector<TerrainMatch> places, const FixAcceptance& acceptance) {
  TerrainFix fix{.status = FixStatus::off_the_dem, .cells = search.cells()};
  std::sort(places.begin(), places.end(), better);
  std::vector<TerrainMatch> found;
  for (const TerrainMatch& peak : peaks(places, 0.5 * acceptance.peak_distance_m)) {
    const auto refined = search.refined(peak);
    if (refined) found.push_back(*refined);
  }
  if (found.empty()) return fix;
  const TerrainMatch best = *std::min_element(found.begin(), found.end(), better);
  const bool at_edge = nearest(places, best).at_edge;
  places.insert(places.end(), found.begin(), found.end());
  fix.T_map_body = best.T_map_body;
  fix.covariance = (best.information + 1e-9 * Matrix6d::Identity()).inverse();
  fix.chi_square = best.chi_square;
  fix.second_chi_square = second_best(best, places, acceptance.peak_distance_m);
  fix.status = verdict(fix, at_edge, acceptance);
  return fix;
}

TerrainFix align_submap(const TerrainPatch& submap, const Pose& T_map_body, const Matrix6d& covariance,
                        std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error,
                        const PatchFactorOptions& factor, const SubmapOptions& options) {
  if (std::ssize(submap.cells) < options.acceptance.min_cells) return {.cells = submap.cells.size()};
  const TerrainSearch search(submap, T_map_body, dem, dem_error, factor, options.sigma_tilt_deg * kRadPerDeg);
  return judged(search, search.scan(window_of(T_map_body, covariance, options)), options.acceptance);
}

}  // namespace demslam

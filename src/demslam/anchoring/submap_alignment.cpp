#include "demslam/anchoring/submap_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "demslam/dem/wiener.h"
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

Matrix6d covariance_of(const TerrainMatch& match) {
  return (match.information + 1e-9 * Matrix6d::Identity()).inverse();
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
  return FixStatus::accepted;
}

/// Minima of the misfit within a few metres of the best one, itself among them, each once. The DEM's noise makes many.
std::vector<TerrainMatch> minima_around(const TerrainSearch& search, const TerrainMatch& best) {
  constexpr int kSteps = 2;                                     // on each side
  constexpr double kStep_m = 2.0, kFar_m = 5.0, kSame_m = 0.2;  // a minimum further off is another place
  std::vector<TerrainMatch> minima{best};
  for (int east = -kSteps; east <= kSteps; ++east) {
    for (int north = -kSteps; north <= kSteps; ++north) {
      TerrainMatch start = best;
      start.T_map_body =
          Pose(best.T_map_body.rotation(), best.T_map_body.translation() + kStep_m * Eigen::Vector3d(east, north, 0.0));
      const auto minimum = search.refined(start);
      if (!minimum || distance_m(*minimum, best) > kFar_m) continue;
      const bool known =
          std::ranges::any_of(minima, [&](const TerrainMatch& other) { return distance_m(*minimum, other) < kSame_m; });
      if (!known) minima.push_back(*minimum);
    }
  }
  return minima;
}

/// Mean and covariance over the minima, each with the probability that it has (Laplace's approximation of each).
void average(TerrainFix& fix, const std::vector<TerrainMatch>& minima) {
  struct Part {
    double weight;
    Vector6d from_best;
    Matrix6d covariance;
  };
  std::vector<Part> parts;
  double total = 0.0;
  for (const TerrainMatch& minimum : minima) {
    const Matrix6d covariance = covariance_of(minimum);
    const double weight = std::exp(-0.5 * (minimum.chi_square - fix.chi_square)) * std::sqrt(covariance.determinant());
    parts.push_back({weight, (fix.T_map_body.inverse() * minimum.T_map_body).log(), covariance});
    total += weight;
  }
  Vector6d mean = Vector6d::Zero();
  for (const Part& part : parts) mean += part.weight / total * part.from_best;
  fix.covariance.setZero();
  for (const Part& part : parts) {
    const Vector6d off = part.from_best - mean;
    fix.covariance += part.weight / total * (part.covariance + off * off.transpose());
  }
  fix.T_map_body = fix.T_map_body * Pose::exp(mean);
}

TerrainFix judged_once(const TerrainSearch& search, std::vector<TerrainMatch> places, const FixAcceptance& acceptance) {
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
  fix.covariance = covariance_of(best);
  fix.chi_square = best.chi_square;
  fix.second_chi_square = second_best(best, places, acceptance.peak_distance_m);
  fix.status = verdict(fix, at_edge, acceptance);
  if (!fix.accepted()) return fix;
  average(fix, minima_around(search, best));
  if (horizontal_sigma_m(fix.T_map_body, fix.covariance) > acceptance.max_sigma_m) fix.status = FixStatus::too_vague;
  return fix;
}

/// All that a search may look at.
MapWindow reach(const SubmapSearch& s) {
  constexpr double kMore_m = 50.0;  // a refined place may leave the window
  double radius_m = 0.0;
  for (const auto& cell : s.submap.cells) radius_m = std::max(radius_m, cell.p_body.norm());
  radius_m += s.window.radius_m + kMore_m;
  const Eigen::Vector3d& p = s.T_map_body.translation();
  return {p.x() - radius_m, p.y() - radius_m, p.x() + radius_m, p.y() + radius_m};
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

TerrainFix judged(const SubmapSearch& s, const FixAcceptance& acceptance) {
  if (std::ssize(s.submap.cells) < acceptance.min_cells) return {.cells = s.submap.cells.size()};
  for (double scale = 1.0;; scale *= 2.0) {
    DemErrorModel error = s.dem_error;
    error.sigma_m *= scale;
    const BelievedDem believed = most_probable(s.dem, error, reach(s));
    const TerrainSearch search(s.submap, s.T_map_body, believed.dem, believed.error, s.factor, s.sigma_tilt_rad);
    TerrainFix fix = judged_once(search, search.scan(s.window), acceptance);
    fix.noise_scale = scale;
    if (fix.status != FixStatus::misfit || 2.0 * scale > acceptance.max_noise_scale) return fix;
  }
}

TerrainFix align_submap(const TerrainPatch& submap, const Pose& T_map_body, const Matrix6d& covariance,
                        std::shared_ptr<const Dem> dem, const DemErrorModel& dem_error,
                        const PatchFactorOptions& factor, const SubmapOptions& options) {
  return judged({submap, T_map_body, std::move(dem), dem_error, factor, options.sigma_tilt_deg * kRadPerDeg,
                 window_of(T_map_body, covariance, options)},
                options.acceptance);
}

}  // namespace demslam

#include "demslam/anchoring/anchor.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <format>
#include <utility>

#include "demslam/anchoring/dem_factors.h"
#include "demslam/anchoring/dem_shift_factor.h"
#include "demslam/anchoring/patch_factor.h"
#include "demslam/geometry/angle.h"
#include "demslam/geometry/covariance.h"

namespace demslam {
namespace {

gtsam::SharedNoiseModel robust(int rows, double sigma, double kernel_sigmas) {
  return gtsam::noiseModel::Robust::Create(gtsam::noiseModel::mEstimator::Cauchy::Create(kernel_sigmas),
                                           gtsam::noiseModel::Isotropic::Sigma(rows, sigma));
}

DemErrorModel stated_error(const AnchoringOptions& options) { return {options.sigma_dem_m, options.dem_correlation_m}; }

TerrainGradient gradient(const AnchoringOptions& options) {
  return options.full_gradient ? TerrainGradient::full : TerrainGradient::vertical_only;
}

double tilt_of(const Pose& T_map_body) {
  return std::acos(std::clamp((T_map_body.rotation() * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

/// Standard deviation of a slope taken over two cells.
double slope_sigma(const DemErrorModel& error, double cell_m) {
  return std::sqrt(2.0 * (error.covariance(0.0) - error.covariance(2.0 * cell_m))) / (2.0 * cell_m);
}

/// Errors of the DEM at one factor after the other are alike: so many of them are worth one. Of their mean, the
/// variance times this is that of independent ones.
double alike_factors(const DemErrorModel& error, double spacing_m) {
  const double step_m = std::max(1.0, spacing_m);
  double sum = 1.0;
  for (double d = step_m; error.correlation(d) > 0.01; d += step_m) sum += 2.0 * error.correlation(d);
  return sum;
}

/// From the keyframe before.
double step_m_to(const PoseGraph& graph, std::size_t keyframe) {
  if (keyframe == 0) return 0.0;
  return (graph.T_map_body(keyframe).translation() - graph.T_map_body(keyframe - 1).translation()).norm();
}

/// A place found on the DEM is as far off as the DEM is.
Matrix6d doubted(const TerrainFix& fix, const AnchoringOptions& options) {
  const Eigen::Vector3d dem_m(options.sigma_shift_m, options.sigma_shift_m, options.sigma_bias_m);
  const Eigen::Matrix3d R = fix.T_map_body.rotation_matrix();
  Matrix6d covariance = fix.covariance;
  covariance.bottomRightCorner<3, 3>() += R.transpose() * dem_m.cwiseAbs2().asDiagonal() * R;
  return covariance;
}

void add_on_dem(PoseGraph& graph, const boost::shared_ptr<DemShiftFactor::PoseFactor>& factor,
                const std::optional<std::uint64_t>& shift) {
  if (shift) {
    graph.add_factor(boost::make_shared<DemShiftFactor>(factor, *shift));
  } else {
    graph.add_factor(factor);
  }
}

}  // namespace

DemAnchor::DemAnchor(std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                     const Eigen::Vector3d& p_body_ground, const Pose& T_body_left)
    : given_(std::move(dem)),
      options_(options),
      terrain_(given_, stated_error(options), options.filter_dem, options.estimate_noise),
      p_body_ground_(p_body_ground),
      T_body_left_(T_body_left),
      patch_(fitted_to(given_->raster().cell_m, options.patch)),
      sigma_contact_m_(relief_within(given_->raster().cell_m, options.sigma_contact_m)) {
  if (!options.submap.recover && !options.submap.factors) return;
  submaps_.emplace(given_, stated_error(options), options.patch, options.patch_factor, options.submap, T_body_left);
}

void DemAnchor::search_start(const StartSearchOptions& options) {
  start_search_.emplace(given_, stated_error(options_), options_.patch, options_.patch_factor, options, T_body_left_);
  report_.start_search = "no fix: too short a way";
}

void DemAnchor::add_landmarks(KeyframeLandmarks landmarks) {
  if (start_search_) start_search_->add(landmarks);
  if (submaps_) submaps_->add(landmarks);
  if (!options_.patches) return;
  landmarks_.push_back(std::move(landmarks));
  constexpr std::size_t kHeld = 2000;  // keyframes; a search for the start may never end
  if (landmarks_.size() > kHeld) landmarks_.erase(landmarks_.begin());
}

/// Made with the first factor that needs it; none when the DEM's place is taken for granted.
std::optional<std::uint64_t> DemAnchor::dem_shift_key(PoseGraph& graph) {
  const bool doubted = options_.sigma_bias_m > 0.0 || options_.sigma_shift_m > 0.0;
  if (doubted && !dem_shift_) {
    constexpr double kNone = 1e-4;  // metres: an axis that is not in doubt
    const double aside = std::max(kNone, options_.sigma_shift_m);
    dem_shift_ = graph.add_shared({aside, aside, std::max(kNone, options_.sigma_bias_m)});
  }
  return dem_shift_;
}

std::string DemShift::text() const {
  const Eigen::Vector3d sigma = sigma_m();
  return std::format("the DEM lies {:+.2f} m East, {:+.2f} m North, {:+.2f} m up (sigma {:.2f}, {:.2f}, {:.2f} m)",
                     metres.x(), metres.y(), metres.z(), sigma.x(), sigma.y(), sigma.z());
}

std::optional<DemShift> DemAnchor::dem_shift(const PoseGraph& graph) const {
  if (!dem_shift_) return std::nullopt;
  return DemShift{graph.shared(*dem_shift_), graph.shared_covariance(*dem_shift_)};
}

AnchoringReport DemAnchor::report() const {
  AnchoringReport report = report_;
  report.noise_scale = terrain_.noise_scale();
  if (submaps_) report.submaps = submaps_->report();
  return report;
}

bool DemAnchor::update(PoseGraph& graph) {
  const bool searching = start_search_.has_value();
  if (searching && !find_start(graph)) return false;
  const int moved = submaps_ ? submaps_->report().moved : 0;
  tie(graph);
  return searching || (submaps_ && submaps_->report().moved > moved);
}

/// Moves everything to where the ground seen so far has been found on the DEM.
bool DemAnchor::find_start(PoseGraph& graph) {
  for (; searched_ < graph.size(); ++searched_) {
    const auto T_correction = start_search_->advance(graph, searched_, step_m_to(graph, searched_));
    if (start_search_->searches() > 0) report_.start_search = "no fix: " + to_string(start_search_->fix().status);
    if (!T_correction) continue;
    graph.move(0, *T_correction);
    const TerrainFix& fix = start_search_->fix();
    graph.add_prior(start_search_->keyframe(), fix.T_map_body, doubted(fix, options_));
    report_.start_search = "found";
    start_correction_ = T_correction;
    start_search_.reset();
    return true;
  }
  return false;
}

void DemAnchor::tie(PoseGraph& graph) {
  for (; seen_ < graph.size(); ++seen_) {
    const double step_m = step_m_to(graph, seen_);
    path_since_anchor_m_ += step_m;
    stretch_m_ += step_m;
    path_m_ += step_m;
    if (seen_ == 0 || path_since_anchor_m_ >= options_.spacing_m) {
      anchor(graph, seen_);
      path_since_anchor_m_ = 0.0;
    }
    if (options_.patches && stretch_m_ >= options_.patch.length_m) close_stretch(graph, seen_);
    if (submaps_) submaps_->advance(graph, seen_, step_m);
  }
}

/// A slope below what the DEM's error alone makes is not believed.
TerrainGradient DemAnchor::believed_slope(const DemSample& ground) {
  if (!options_.full_gradient) return TerrainGradient::vertical_only;
  if (!options_.gate || ground.gradient.norm() > slope_sigma(here_.error, here_.dem->raster().cell_m))
    return TerrainGradient::full;
  ++report_.gated_heights;
  return TerrainGradient::vertical_only;
}

void DemAnchor::anchor(PoseGraph& graph, std::size_t keyframe) {
  if (!options_.height && !options_.normal) return;
  const Eigen::Vector3d p = graph.T_map_body(keyframe) * p_body_ground_;
  here_ = terrain_.around(p.head<2>());
  const auto ground = here_.dem->sample(p.x(), p.y());
  if (!ground) {
    ++report_.skipped_outside;
    return;
  }
  if (options_.height) {
    const double alike = options_.alike_errors ? alike_factors(here_.error, options_.spacing_m) : 1.0;
    const std::optional<double> mapped_m = given_->sigma_m(p.x(), p.y());
    const double sigma_dem_m = std::sqrt(alike) * (mapped_m ? terrain_.noise_scale() * *mapped_m : here_.error.sigma_m);
    const auto noise = robust(1, std::hypot(sigma_dem_m, sigma_contact_m_), options_.kernel_sigmas);
    add_on_dem(graph,
               boost::make_shared<DemHeightFactor>(keyframe, here_.dem, p_body_ground_, noise, believed_slope(*ground)),
               dem_shift_key(graph));
    ++report_.height;
  }
  if (options_.normal) add_normal(graph, keyframe, *ground);
}

/// Of the newest keyframe; looked up anew every 50 m.
double DemAnchor::horizontal_sigma_m(const PoseGraph& graph) {
  constexpr double kEvery_m = 50.0;
  if (!horizontal_sigma_m_ || path_m_ - sigma_known_at_m_ > kEvery_m) {
    sigma_known_at_m_ = path_m_;
    horizontal_sigma_m_ = demslam::horizontal_sigma_m(graph.T_map_body(graph.size() - 1), graph.newest_covariance());
  }
  return *horizontal_sigma_m_;
}

void DemAnchor::add_normal(PoseGraph& graph, std::size_t keyframe, const DemSample& ground) {
  if (tilt_of(graph.T_map_body(keyframe)) > options_.max_tilt_deg * kRadPerDeg) {
    ++report_.skipped_tilt;
    return;
  }
  constexpr double kVague_rad = 12.0 * kRadPerDeg;
  double sigma_rad = options_.sigma_normal_deg * kRadPerDeg;
  if (options_.gate) {
    const double elsewhere_rad = ground.hessian.norm() * horizontal_sigma_m(graph);
    sigma_rad = std::hypot(sigma_rad, slope_sigma(here_.error, here_.dem->raster().cell_m), elsewhere_rad);
  }
  if (sigma_rad > kVague_rad) {
    ++report_.skipped_vague;
    return;
  }
  const auto noise = robust(2, sigma_rad, options_.kernel_sigmas);
  const auto slope = options_.gate ? TerrainGradient::vertical_only : gradient(options_);
  add_on_dem(graph, boost::make_shared<DemNormalFactor>(keyframe, here_.dem, p_body_ground_, noise, slope),
             dem_shift_key(graph));
  ++report_.normal;
}

/// The evidence of the last patches, about five of them, decides: one alone is small.
TerrainGradient DemAnchor::believed_relief(const TerrainPatch& patch, const Pose& T_map_body) {
  if (!options_.gate) return TerrainGradient::full;
  constexpr double kMemory = 0.8;
  relief_evidence_ = kMemory * relief_evidence_ + relief_evidence(patch, T_map_body, *here_.dem, here_.error);
  if (relief_evidence_ > 0.0) return TerrainGradient::full;
  ++report_.gated_patches;
  return TerrainGradient::vertical_only;
}

void DemAnchor::close_stretch(PoseGraph& graph, std::size_t end) {
  const std::size_t middle = (stretch_begin_ + end) / 2;
  std::vector<PosedLandmarks> stretch;
  for (const KeyframeLandmarks& seen : landmarks_) {
    if (seen.keyframe <= end) stretch.push_back({graph.T_map_body(seen.keyframe) * T_body_left_, &seen.points});
  }
  const Pose& T_map_middle = graph.T_map_body(middle);
  here_ = terrain_.around(T_map_middle.translation().head<2>());
  const auto patch = build_patch(stretch, middle, T_map_middle, *here_.dem, patch_);
  if (patch) {
    terrain_.add(*patch, T_map_middle);
    here_ = terrain_.around(T_map_middle.translation().head<2>());
    add_on_dem(graph,
               boost::make_shared<TerrainPatchFactor>(*patch, here_.dem, here_.error, options_.patch_factor,
                                                      believed_relief(*patch, T_map_middle)),
               dem_shift_key(graph));
    ++report_.patches;
    report_.patch_cells += static_cast<int>(patch->cells.size());
  } else {
    ++report_.skipped_patches;
  }
  std::erase_if(landmarks_, [&](const KeyframeLandmarks& seen) { return seen.keyframe <= end; });
  stretch_begin_ = end + 1;
  stretch_m_ = 0.0;
}

AnchoringReport add_dem_factors(PoseGraph& graph, std::shared_ptr<const Dem> dem, const AnchoringOptions& options,
                                const Eigen::Vector3d& p_body_ground) {
  DemAnchor anchor(std::move(dem), options, p_body_ground);
  anchor.update(graph);
  return anchor.report();
}

}  // namespace demslam

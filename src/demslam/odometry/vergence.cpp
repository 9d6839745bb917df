#include "demslam/odometry/vergence.h"

#include <cmath>

#include "demslam/geometry/angle.h"

namespace demslam {

double Vergence::sigma_rad() const { return std::sqrt(variance_rad2); }

Vergence calibrated_vergence(const SelfCalibrationOptions& options) {
  const double sigma_rad = options.enabled ? options.vergence_sigma_deg * kRadPerDeg : 0.0;
  return {.variance_rad2 = sigma_rad * sigma_rad};
}

Vergence after_path(Vergence known, const SelfCalibrationOptions& options, double path_m) {
  if (!(known.variance_rad2 > 0.0)) return known;
  const double walk_rad = options.vergence_walk_deg_per_sqrt_km * kRadPerDeg;
  known.variance_rad2 += walk_rad * walk_rad * path_m * 1e-3;
  return known;
}

bool plausible(const Vergence& found, const SelfCalibrationOptions& options) {
  constexpr double kSigmas = 5.0;
  return std::abs(found.rad) < kSigmas * options.vergence_sigma_deg * kRadPerDeg;
}

Vergence learned(const Vergence& prior, const Vergence& posterior, double share) {
  if (!(prior.variance_rad2 > 0.0)) return prior;
  const double before = 1.0 / prior.variance_rad2, after = 1.0 / posterior.variance_rad2;
  const double information = before + share * (after - before);
  const double weighted = before * prior.rad + share * (after * posterior.rad - before * prior.rad);
  return {weighted / information, 1.0 / information};
}

}  // namespace demslam

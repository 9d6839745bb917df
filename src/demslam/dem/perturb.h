#pragma once

#include <cstdint>
#include <vector>

#include "demslam/dem/dem.h"

namespace demslam {

/// A stationary Gaussian random field on a regular grid, row-major: unit-variance white noise filtered by a separable
/// Gaussian, so that its autocorrelation is exp(-(d / correlation_length)^2). Every cell has exactly the stated
/// standard deviation over the seeds (a small raster's own RMS scatters around it). Same seed and shape, same field.
struct GaussianField {
  double rms = 0.0;
  double correlation_length_m = 10.0;  ///< where the autocorrelation has fallen to 1/e
  std::uint64_t seed = 1;
};

std::vector<float> gaussian_field(const GaussianField& field, int rows, int cols, double cell_m);

/// What may be wrong with a DEM (docs/conventions.md, "DEM"): applied in the order noise, bias, shift.
struct Perturbation {
  GaussianField noise_m;                              ///< vertical
  double bias_m = 0.0;                                ///< added to every height
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();  ///< the terrain moves by this much; exact, without resampling
};

DemRaster perturb(DemRaster dem, const Perturbation& perturbation);

}  // namespace demslam

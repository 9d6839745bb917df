#pragma once

#include <cmath>

namespace demslam {

/// Error of a DEM's heights: stationary, of one standard deviation. What is known of an autocorrelation is usually one
/// length, where it has fallen to 1/e; but such errors have a tail (strips, tracks, tilted tiles), and taking it for a
/// plain exponential makes everything that rests on tens of metres of ground too sure of itself. Two exponentials
/// therefore, 40 % of the variance with a length five times the other's; positive definite in the plane.
struct DemErrorModel {
  double sigma_m = 0.5;
  double correlation_length_m = 10.0;

  double correlation(double distance_m) const {
    const double d = distance_m / correlation_length_m;
    return 0.6 * std::exp(-1.868547 * d) + 0.4 * std::exp(-0.3737094 * d);  // 1/e at d = 1
  }
  double covariance(double distance_m) const { return sigma_m * sigma_m * correlation(distance_m); }
};

}  // namespace demslam

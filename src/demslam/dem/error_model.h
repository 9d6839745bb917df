#pragma once

#include <cmath>

namespace demslam {

/// Error of a DEM's heights: stationary, autocorrelation exp(-d / correlation_length).
struct DemErrorModel {
  double sigma_m = 0.5;
  double correlation_length_m = 10.0;

  double covariance(double distance_m) const {
    return sigma_m * sigma_m * std::exp(-distance_m / correlation_length_m);
  }
};

}  // namespace demslam

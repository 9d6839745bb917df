#pragma once

#include <Eigen/Core>
#include <vector>

namespace demslam {

/// Normalised estimation error squared of positions: e^T P^-1 e per pose, 3 degrees of freedom each. An estimator whose
/// covariances are honest has a mean of about 3 that lies in the band in 95 % of independent runs; above it is too sure
/// of itself, below too timid. Errors along one run are correlated, so that the band of a single run is optimistic.
struct Nees {
  std::vector<double> per_pose;
  double mean = 0.0;
  double lower_95 = 0.0, upper_95 = 0.0;  ///< two-sided band of the mean, chi-square with 3 n degrees of freedom over n
};

/// Errors in metres and their covariances in the same axes, at least one. Throws Error when a covariance is not
/// positive definite.
Nees nees(const std::vector<Eigen::Vector3d>& errors, const std::vector<Eigen::Matrix3d>& covariances);

/// The value below which a chi-square variable of `degrees_of_freedom` lies with `probability`.
double chi_square_quantile(double probability, double degrees_of_freedom);

}  // namespace demslam

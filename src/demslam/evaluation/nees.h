#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace demslam {

/// The mean of squared errors in sigmas over the poses of a run, and where an honest estimator's would lie.
struct NeesMean {
  int degrees_of_freedom = 3;
  double mean = 0.0;                      ///< honest: about `degrees_of_freedom`
  double lower_95 = 0.0, upper_95 = 0.0;  ///< two-sided band of the mean for `effective_poses` independent poses
  double effective_poses = 0.0;           ///< errors along a run are correlated: as many independent ones say as much

  bool consistent() const { return lower_95 <= mean && mean <= upper_95; }
};

/// Normalised estimation error squared of positions, e^T P^-1 e per pose. Above the band the estimator is too sure of
/// itself, below too timid.
///
/// The band allows for the correlation within the run: whitened errors u have the autocorrelation rho_k = mean(u_i .
/// u_(i+k)) / mean(u . u), about zero since an honest error has no mean; squares of Gaussian variables are correlated
/// by rho_k^2, and n of them are worth n / (1 + 2 sum_k rho_k^2) independent ones, the sum taken up to the first rho_k
/// below 0.1. The band is chi-square with that many times the degrees of freedom. A run that drifts one way is worth
/// one pose.
struct Nees {
  std::vector<double> per_pose;
  NeesMean position, horizontal{.degrees_of_freedom = 2}, vertical{.degrees_of_freedom = 1};
};

/// Errors in metres and their covariances in the same axes (the third one is up), at least one, in the order of time.
/// Throws Error when a covariance is not positive definite.
Nees nees(const std::vector<Eigen::Vector3d>& errors, const std::vector<Eigen::Matrix3d>& covariances);

/// "position 2.81 of 3 (95 %: 1.20 to 5.60; 312 poses worth 9.4): consistent; horizontal ...".
std::string describe(const Nees& nees);

/// The value below which a chi-square variable of `degrees_of_freedom` lies with `probability`.
double chi_square_quantile(double probability, double degrees_of_freedom);

}  // namespace demslam

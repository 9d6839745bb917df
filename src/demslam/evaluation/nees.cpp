#include "demslam/evaluation/nees.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>
#include <string>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr double kPrecision = 1e-15;

/// exp(-x) x^a / Gamma(a), in logarithms against overflow.
double gamma_front(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

/// Regularised lower incomplete gamma function P(a, x): its power series.
double lower_gamma_series(double a, double x) {
  double term = 1.0 / a, sum = term;
  for (double n = 1.0; term > kPrecision * sum; n += 1.0) sum += term *= x / (a + n);
  return gamma_front(a, x) * sum;
}

/// Its complement Q(a, x): the continued fraction by Lentz's method.
double upper_gamma_fraction(double a, double x) {
  double b = x + 1.0 - a, c = 1e300, d = 1.0 / b, product = d;
  for (double n = 1.0, factor = 0.0; std::abs(factor - 1.0) > kPrecision && n < 100000.0; n += 1.0) {
    const double numerator = n * (a - n);
    b += 2.0;
    d = 1.0 / (b + numerator * d);
    c = b + numerator / c;
    product *= factor = c * d;
  }
  return gamma_front(a, x) * product;
}

double chi_square_cdf(double value, double degrees_of_freedom) {
  const double a = degrees_of_freedom / 2.0, x = value / 2.0;
  if (x <= 0.0) return 0.0;
  return x < a + 1.0 ? lower_gamma_series(a, x) : 1.0 - upper_gamma_fraction(a, x);
}

}  // namespace

double chi_square_quantile(double probability, double degrees_of_freedom) {
  double low = 0.0, high = degrees_of_freedom + 10.0;
  while (chi_square_cdf(high, degrees_of_freedom) < probability) high *= 2.0;
  for (int i = 0; i < 200 && high - low > 1e-13 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (chi_square_cdf(middle, degrees_of_freedom) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Nees nees(const std::vector<Eigen::Vector3d>& errors, const std::vector<Eigen::Matrix3d>& covariances) {
  Nees result;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const Eigen::LLT<Eigen::Matrix3d> factor(covariances.at(i));
    if (factor.info() != Eigen::Success) {
      throw Error("the position covariance of pose " + std::to_string(i) + " is not positive definite");
    }
    result.per_pose.push_back(errors[i].dot(factor.solve(errors[i])));
  }
  const double n = static_cast<double>(errors.size());
  result.mean = std::accumulate(result.per_pose.begin(), result.per_pose.end(), 0.0) / n;
  result.lower_95 = chi_square_quantile(0.025, 3.0 * n) / n;
  result.upper_95 = chi_square_quantile(0.975, 3.0 * n) / n;
  return result;
}

}  // namespace demslam

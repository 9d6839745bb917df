#include "demslam/evaluation/nees.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
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

namespace {

constexpr std::size_t kMostSamples = 2000;  // of a run, for its autocorrelation
constexpr double kUncorrelated = 0.1;

/// Columns are whitened errors, one per pose.
double effective_poses(const Eigen::MatrixXd& whitened) {
  const Eigen::Index n = whitened.cols();
  const Eigen::Index stride =
      (n + static_cast<Eigen::Index>(kMostSamples) - 1) / static_cast<Eigen::Index>(kMostSamples);
  Eigen::MatrixXd u(whitened.rows(), (n + stride - 1) / stride);
  for (Eigen::Index i = 0; i < u.cols(); ++i) u.col(i) = whitened.col(i * stride);
  const double power = u.squaredNorm() / static_cast<double>(u.cols());
  double length = 1.0;
  for (Eigen::Index lag = 1; lag < u.cols(); ++lag) {
    const Eigen::Index pairs = u.cols() - lag;
    const double rho = u.leftCols(pairs).cwiseProduct(u.rightCols(pairs)).sum() / (static_cast<double>(pairs) * power);
    if (!(rho > kUncorrelated)) break;
    length += 2.0 * std::min(1.0, rho * rho);
  }
  const double worth = stride > 1 && length == 1.0 ? static_cast<double>(n) : static_cast<double>(u.cols()) / length;
  return std::clamp(worth, 1.0, static_cast<double>(n));
}

/// Of the rows begin .. begin + degrees_of_freedom - 1 of the errors.
NeesMean mean_of(const std::vector<Eigen::Vector3d>& errors, const std::vector<Eigen::Matrix3d>& covariances, int begin,
                 int degrees_of_freedom, std::vector<double>* per_pose) {
  Eigen::MatrixXd whitened(degrees_of_freedom, std::ssize(errors));
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const Eigen::MatrixXd part = covariances.at(i).block(begin, begin, degrees_of_freedom, degrees_of_freedom);
    const Eigen::LLT<Eigen::MatrixXd> factor(part);
    if (factor.info() != Eigen::Success)
      throw Error("the position covariance of pose " + std::to_string(i) + " is not positive definite");
    whitened.col(static_cast<Eigen::Index>(i)) = factor.matrixL().solve(errors[i].segment(begin, degrees_of_freedom));
    if (per_pose != nullptr) per_pose->push_back(whitened.col(static_cast<Eigen::Index>(i)).squaredNorm());
  }
  NeesMean result{.degrees_of_freedom = degrees_of_freedom};
  result.mean = whitened.squaredNorm() / static_cast<double>(errors.size());
  result.effective_poses = effective_poses(whitened);
  const double freedom = degrees_of_freedom * result.effective_poses;
  result.lower_95 = chi_square_quantile(0.025, freedom) / result.effective_poses;
  result.upper_95 = chi_square_quantile(0.975, freedom) / result.effective_poses;
  return result;
}

std::string describe(const NeesMean& m) {
  const char* verdict = m.consistent() ? "consistent" : m.mean > m.upper_95 ? "too sure" : "too timid";
  return fmt::format("{:.2f} of {} (95 %: {:.2f} to {:.2f}, worth {:.1f} poses), {}", m.mean, m.degrees_of_freedom,
                     m.lower_95, m.upper_95, m.effective_poses, verdict);
}

}  // namespace

Nees nees(const std::vector<Eigen::Vector3d>& errors, const std::vector<Eigen::Matrix3d>& covariances) {
  Nees result;
  result.position = mean_of(errors, covariances, 0, 3, &result.per_pose);
  result.horizontal = mean_of(errors, covariances, 0, 2, nullptr);
  result.vertical = mean_of(errors, covariances, 2, 1, nullptr);
  return result;
}

std::string describe(const Nees& nees) {
  return fmt::format("NEES over {} keyframes: position {}; horizontal {}; vertical {}", nees.per_pose.size(),
                     describe(nees.position), describe(nees.horizontal), describe(nees.vertical));
}

}  // namespace demslam

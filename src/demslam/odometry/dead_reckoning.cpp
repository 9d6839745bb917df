#include "demslam/odometry/dead_reckoning.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "demslam/geometry/angle.h"

namespace demslam {
namespace {

constexpr double kStep_s = 0.1;
constexpr double kWheelFloor_m = 0.01;

template <class Sample>
bool covers(const std::vector<Sample>& samples, TimestampNs from_ns, TimestampNs to_ns) {
  return !samples.empty() && samples.front().t_ns <= from_ns && samples.back().t_ns >= to_ns;
}

template <class Sample>
auto first_from(const std::vector<Sample>& samples, TimestampNs t_ns) {
  return std::ranges::lower_bound(samples, t_ns, {}, &Sample::t_ns);
}

/// Mean of the samples between two times, the one right behind included.
Eigen::Vector3d mean_rate(const std::vector<ImuSample>& imu, TimestampNs from_ns, TimestampNs to_ns) {
  auto sample = first_from(imu, from_ns);
  Eigen::Vector3d sum = sample->angular_rate_rad_s;
  int count = 1;
  for (++sample; sample != imu.end() && sample->t_ns <= to_ns; ++sample, ++count) sum += sample->angular_rate_rad_s;
  return sum / count;
}

/// Mean of both sides, between the samples.
double rolled_m(const std::vector<WheelSample>& wheels, TimestampNs t_ns) {
  const auto after = first_from(wheels, t_ns);
  const auto before = after == wheels.begin() ? after : after - 1;
  const auto distance_m = [](const WheelSample& w) { return 0.5 * (w.left_m + w.right_m); };
  if (after->t_ns == before->t_ns) return distance_m(*after);
  const double part = static_cast<double>(t_ns - before->t_ns) / static_cast<double>(after->t_ns - before->t_ns);
  return std::lerp(distance_m(*before), distance_m(*after), part);
}

Matrix6d covariance_of(double rotation_sigma_rad, double translation_sigma_m) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(rotation_sigma_rad), Eigen::Vector3d::Constant(translation_sigma_m);
  return sigma.cwiseAbs2().asDiagonal();
}

/// Standard deviation of the translation in its worst direction.
double worst_sigma_m(const Matrix6d& covariance) {
  const Eigen::Matrix3d translation = covariance.bottomRightCorner<3, 3>();
  return std::sqrt(translation.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
}

}  // namespace

ReckonedStep supported(const ReckonedStep& seen, const ReckonedStep& reckoned) {
  if (worst_sigma_m(seen.covariance) <= worst_sigma_m(reckoned.covariance)) return seen;
  const Vector6d apart = (seen.T_from_to.inverse() * reckoned.T_from_to).log();
  const double chi_square = apart.dot((seen.covariance + reckoned.covariance).ldlt().solve(apart));
  const Matrix6d widened = std::max(1.0, chi_square / 6.0) * seen.covariance;
  const Matrix6d gain = (widened + reckoned.covariance).ldlt().solve(widened).transpose();
  return {seen.T_from_to * Pose::exp(gain * apart), widened - gain * widened};
}

ReckonedStep DeadReckoning::step(TimestampNs from_ns, TimestampNs to_ns, const Vector6d& twist_per_s) const {
  const bool imu = options_.use_imu && covers(sensors_.imu, from_ns, to_ns);
  const bool wheels = options_.use_wheels && covers(sensors_.wheels, from_ns, to_ns);
  if (imu || wheels) return by_sensors(from_ns, to_ns, twist_per_s, imu, wheels);
  const double seconds = to_seconds(to_ns - from_ns);
  return {Pose::exp(twist_per_s * seconds),
          covariance_of(options_.lost_sigma_deg_per_s * kRadPerDeg * seconds, options_.lost_sigma_m_per_s * seconds)};
}

ReckonedStep DeadReckoning::by_sensors(TimestampNs from_ns, TimestampNs to_ns, const Vector6d& twist_per_s, bool imu,
                                       bool wheels) const {
  const double seconds = to_seconds(to_ns - from_ns);
  const int steps = std::max(1, static_cast<int>(std::ceil(seconds / kStep_s)));
  const Vector6d last_twist = T_body_left_.adjoint() * twist_per_s;  // in the body
  Pose T_from_to;                                                    // of the body
  double distance_m = 0.0;
  for (int n = 0; n < steps; ++n) {
    const TimestampNs t_0 = from_ns + (to_ns - from_ns) * n / steps,
                      t_1 = from_ns + (to_ns - from_ns) * (n + 1) / steps;
    const double dt_s = to_seconds(t_1 - t_0);
    Vector6d xi = last_twist * dt_s;
    if (imu) xi.head<3>() = mean_rate(sensors_.imu, t_0, t_1) * dt_s;
    if (wheels)
      xi.tail<3>() = Eigen::Vector3d::UnitX() * (rolled_m(sensors_.wheels, t_1) - rolled_m(sensors_.wheels, t_0));
    distance_m += xi.tail<3>().norm();
    T_from_to = T_from_to * Pose::exp(xi);
  }
  const double rotation_sigma =
      (imu ? options_.gyro_sigma_deg_per_s : options_.lost_sigma_deg_per_s) * kRadPerDeg * seconds;
  const double translation_sigma = wheels ? kWheelFloor_m + (options_.wheel_sigma + rotation_sigma) * distance_m
                                          : options_.lost_sigma_m_per_s * seconds;
  const Pose T_left_body = T_body_left_.inverse();
  const Matrix6d ad = T_left_body.adjoint();
  return {T_left_body * T_from_to * T_body_left_,
          ad * covariance_of(rotation_sigma, translation_sigma) * ad.transpose()};
}

}  // namespace demslam

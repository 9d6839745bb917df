#include "demslam/odometry/bundle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace demslam {
namespace {

constexpr int kMaxIterations = 12;
constexpr double kCauchyScale2 = 4.0;                                 // squared, in standard deviations
constexpr double kInlierChiSquare2 = 13.8, kInlierChiSquare3 = 16.3;  // 99.9 %, 2 and 3 degrees of freedom
constexpr double kMinDepthM = 1e-3, kMinDisparityPx = 1e-2;
constexpr double kConvergedCost = 1e-6;  // relative

double robust_cost(double chi_square) { return kCauchyScale2 * std::log1p(chi_square / kCauchyScale2); }
double robust_weight(double chi_square) { return 1.0 / (1.0 + chi_square / kCauchyScale2); }

/// One landmark's rows of the normal equations: its own 1 x 1 block and its coupling with the views it touches and with
/// the vergence.
struct LandmarkBlock {
  double H = 0.0, b = 0.0;
  std::vector<std::pair<int, Vector6d>> coupling;  // by view
  double vergence_coupling = 0.0;

  void couple(int view, const Vector6d& value) {
    for (auto& [known, sum] : coupling) {
      if (known == view) {
        sum += value;
        return;
      }
    }
    coupling.emplace_back(view, value);
  }
};

/// Normal equations H * x = b; the part of the views and, behind them, of the vergence is dense.
struct NormalEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  std::vector<LandmarkBlock> landmarks;
  double cost = 0.0;
};

/// What is known of the residuals at an estimate.
struct Statistics {
  std::vector<bool> inlier;
  int inliers = 0, measured = 0;
  double chi_square = 0.0, squared_px = 0.0;
};

class Solver {
 public:
  Solver(const RectifiedRig& rig, const StereoNoise& noise, const Bundle& bundle) : rig_(rig), noise_(noise) {
    restore(bundle);
  }

  NormalEquations linearise() const;
  double cost() const;
  /// Moves the bundle by the damped step; false when the equations cannot be solved.
  bool step(const NormalEquations& equations, double damping);
  Statistics statistics() const;
  /// Inverse of the Hessian of what is free, the landmarks eliminated: views 1, 2, ... and, where it is, the vergence.
  std::optional<Eigen::MatrixXd> covariance(const NormalEquations& equations) const;

  const Bundle& bundle() const { return bundle_; }
  void restore(const Bundle& bundle) {
    bundle_ = bundle;
    rig_.vergence_rad = bundle_.vergence_rad;
  }

 private:
  bool vergence_is_free() const { return bundle_.vergence.variance_rad2 > 0.0; }
  int vergence_index() const { return 6 * static_cast<int>(bundle_.T_world_left.size()); }
  /// Behind view 0.
  int free_size() const { return vergence_index() - 6 + (vergence_is_free() ? 1 : 0); }
  double vergence_error() const { return bundle_.vergence.rad - bundle_.vergence_rad; }
  BundleError error_of(const BundleObservation& observation) const {
    const BundleLandmark& landmark = bundle_.landmarks[observation.landmark];
    StereoPixel host_pixel = landmark.measured;
    host_pixel.z() = landmark.disparity_px;
    return bundle_error(rig_, bundle_.T_world_left[landmark.host], bundle_.T_world_left[observation.view], host_pixel,
                        observation.pixel);
  }
  Eigen::Matrix3d information_of(const BundleObservation& observation) const {
    const Eigen::Matrix3d covariance = noise_.covariance_b(observation.pixel, observation.covariance);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    information.topLeftCorner<2, 2>() = covariance.topLeftCorner<2, 2>().inverse();
    if (has_disparity(observation.pixel)) information(2, 2) = 1.0 / covariance(2, 2);
    return information;
  }
  double chi_square(const BundleObservation& observation, const BundleError& error) const {
    return error.error.dot(information_of(observation) * error.error);
  }
  double host_information(const BundleLandmark& landmark) const {
    return 1.0 / noise_.covariance_a(landmark.measured)(2, 2);
  }
  double host_chi_square(const BundleLandmark& landmark) const {
    const double error = landmark.measured.z() - landmark.disparity_px;
    return error * error * host_information(landmark);
  }
  void add_observation(const BundleObservation& observation, NormalEquations& equations) const;
  void eliminate_landmarks(const NormalEquations& equations, double damping, Eigen::MatrixXd& H,
                           Eigen::VectorXd& b) const;

  RectifiedRig rig_;  // with the bundle's vergence
  StereoNoise noise_;
  Bundle bundle_;
};

void Solver::add_observation(const BundleObservation& observation, NormalEquations& equations) const {
  const BundleError error = error_of(observation);
  if (!error.in_front) return;
  const double chi2 = chi_square(observation, error);
  const Eigen::Matrix3d information = robust_weight(chi2) * information_of(observation);
  const std::array<int, 2> views = {bundle_.landmarks[observation.landmark].host, observation.view};
  const std::array<const Eigen::Matrix<double, 3, 6>*, 2> jacobians = {&error.by_host, &error.by_view};
  LandmarkBlock& landmark = equations.landmarks[observation.landmark];
  const Eigen::Vector3d weighted = information * error.by_disparity;
  landmark.H += weighted.dot(error.by_disparity);
  landmark.b -= weighted.dot(error.error);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Matrix<double, 6, 3> JtW = jacobians[i]->transpose() * information;
    equations.b.segment<6>(6 * views[i]) -= JtW * error.error;
    landmark.couple(views[i], JtW * error.by_disparity);
    for (int j = 0; j < 2; ++j) equations.H.block<6, 6>(6 * views[i], 6 * views[j]) += JtW * *jacobians[j];
  }
  if (!vergence_is_free()) return;
  const int last = vergence_index();
  const Eigen::Vector3d by_vergence = information * error.by_vergence;
  equations.H(last, last) += by_vergence.dot(error.by_vergence);
  equations.b[last] -= by_vergence.dot(error.error);
  landmark.vergence_coupling += by_vergence.dot(error.by_disparity);
  for (int i = 0; i < 2; ++i) {
    const Vector6d cross = jacobians[i]->transpose() * by_vergence;
    equations.H.block<6, 1>(6 * views[i], last) += cross;
    equations.H.block<1, 6>(last, 6 * views[i]) += cross.transpose();
  }
}

NormalEquations Solver::linearise() const {
  const int size = vergence_index() + 1;
  NormalEquations equations{.H = Eigen::MatrixXd::Zero(size, size), .b = Eigen::VectorXd::Zero(size)};
  equations.landmarks.resize(bundle_.landmarks.size());
  for (std::size_t i = 0; i < bundle_.landmarks.size(); ++i) {
    const BundleLandmark& landmark = bundle_.landmarks[i];
    const double information = robust_weight(host_chi_square(landmark)) * host_information(landmark);
    equations.landmarks[i].H = information;
    equations.landmarks[i].b = information * (landmark.measured.z() - landmark.disparity_px);
  }
  for (const BundleObservation& observation : bundle_.observations) add_observation(observation, equations);
  if (vergence_is_free()) {
    equations.H(vergence_index(), vergence_index()) += 1.0 / bundle_.vergence.variance_rad2;
    equations.b[vergence_index()] += vergence_error() / bundle_.vergence.variance_rad2;
  }
  return equations;
}

double Solver::cost() const {
  double cost = 0.0;
  for (const BundleLandmark& landmark : bundle_.landmarks) cost += robust_cost(host_chi_square(landmark));
  for (const BundleObservation& observation : bundle_.observations) {
    const BundleError error = error_of(observation);
    cost += robust_cost(error.in_front ? chi_square(observation, error) : 1e6);
  }
  if (vergence_is_free()) cost += vergence_error() * vergence_error() / bundle_.vergence.variance_rad2;
  return cost;
}

void Solver::eliminate_landmarks(const NormalEquations& equations, double damping, Eigen::MatrixXd& H,
                                 Eigen::VectorXd& b) const {
  H = equations.H;
  b = equations.b;
  const int last = vergence_index();
  for (const LandmarkBlock& landmark : equations.landmarks) {
    const double inverse = 1.0 / (landmark.H * (1.0 + damping));
    b[last] -= inverse * landmark.b * landmark.vergence_coupling;
    H(last, last) -= inverse * landmark.vergence_coupling * landmark.vergence_coupling;
    for (const auto& [i, coupling_i] : landmark.coupling) {
      b.segment<6>(6 * i) -= inverse * landmark.b * coupling_i;
      for (const auto& [j, coupling_j] : landmark.coupling) {
        H.block<6, 6>(6 * i, 6 * j) -= inverse * coupling_i * coupling_j.transpose();
      }
      const Vector6d cross = inverse * landmark.vergence_coupling * coupling_i;
      H.block<6, 1>(6 * i, last) -= cross;
      H.block<1, 6>(last, 6 * i) -= cross.transpose();
    }
  }
}

bool Solver::step(const NormalEquations& equations, double damping) {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  eliminate_landmarks(equations, damping, H, b);
  H.diagonal() += damping * equations.H.diagonal();
  const int free = free_size();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  x.segment(6, free) = H.block(6, 6, free, free).ldlt().solve(b.segment(6, free));
  if (!x.allFinite()) return false;
  for (std::size_t i = 1; i < bundle_.T_world_left.size(); ++i) {
    bundle_.T_world_left[i] = bundle_.T_world_left[i] * Pose::exp(x.segment<6>(6 * i));
  }
  for (std::size_t i = 0; i < bundle_.landmarks.size(); ++i) {
    const LandmarkBlock& block = equations.landmarks[i];
    double rest = block.b - block.vergence_coupling * x[vergence_index()];
    for (const auto& [view, coupling] : block.coupling) rest -= coupling.dot(x.segment<6>(6 * view));
    double& disparity = bundle_.landmarks[i].disparity_px;
    disparity = std::max(kMinDisparityPx, disparity + rest / (block.H * (1.0 + damping)));
  }
  bundle_.vergence_rad += x[vergence_index()];
  rig_.vergence_rad = bundle_.vergence_rad;
  return true;
}

Statistics Solver::statistics() const {
  Statistics statistics;
  for (const BundleObservation& observation : bundle_.observations) {
    const BundleError error = error_of(observation);
    const bool with_disparity = has_disparity(observation.pixel);
    const double chi2 = error.in_front ? chi_square(observation, error) : 1e6;
    const bool inlier = chi2 < (with_disparity ? kInlierChiSquare3 : kInlierChiSquare2);
    statistics.inlier.push_back(inlier);
    if (!inlier) continue;
    ++statistics.inliers;
    statistics.measured += with_disparity ? 3 : 2;
    statistics.chi_square += chi2;
    statistics.squared_px += error.error.head<2>().squaredNorm();
  }
  return statistics;
}

std::optional<Eigen::MatrixXd> Solver::covariance(const NormalEquations& equations) const {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  eliminate_landmarks(equations, 0.0, H, b);
  const int free = free_size();
  const Eigen::LLT<Eigen::MatrixXd> factor(H.block(6, 6, free, free));
  if (factor.info() != Eigen::Success || factor.rcond() < 1e-15) return std::nullopt;
  return factor.solve(Eigen::MatrixXd::Identity(free, free));
}

/// Levenberg-Marquardt; returns the iterations.
int minimise(Solver& solver) {
  double cost = solver.cost(), damping = 1e-6;
  int iteration = 0;
  for (bool converged = false; iteration < kMaxIterations && !converged; ++iteration) {
    const NormalEquations equations = solver.linearise();
    const Bundle before = solver.bundle();
    const bool solved = solver.step(equations, damping);
    const double next = solved ? solver.cost() : cost;
    if (solved && next <= cost) {
      converged = cost - next < kConvergedCost * cost;
      cost = next;
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      solver.restore(before);
      damping *= 10.0;
      converged = damping > 1e3;
    }
  }
  return iteration;
}

}  // namespace

BundleError bundle_error(const RectifiedRig& rig, const Pose& T_world_host, const Pose& T_world_view,
                         const StereoPixel& host_pixel, const StereoPixel& view_pixel) {
  BundleError result;
  const Pose T_view_host = T_world_view.inverse() * T_world_host;
  const Eigen::Vector3d p_host = unproject(rig, host_pixel), p_view = T_view_host * p_host;
  result.in_front = p_view.z() > kMinDepthM;
  if (!result.in_front) return result;
  const Eigen::Matrix3d H = projection_jacobian(rig, p_view);
  result.error = view_pixel - project(rig, p_view);
  result.by_view = -H * point_jacobian(p_view);
  // T_view_host Exp(xi): p_view moves by R (omega x p_host + v).
  const Eigen::Matrix3d HR = H * T_view_host.rotation_matrix();
  result.by_host << HR * skew(p_host), -HR;
  result.by_disparity = HR * p_host / rig.parallax_px(host_pixel.z());  // p_host is its inverse
  result.by_vergence = -rig.focal_px * (result.by_disparity + Eigen::Vector3d::UnitZ());
  return result;
}

BundleReport optimize_bundle(const RectifiedRig& rig, const StereoNoise& noise, Bundle& bundle) {
  Solver solver(rig, noise, bundle);
  BundleReport report;
  report.iterations = minimise(solver);
  const auto covariance = solver.covariance(solver.linearise());
  if (!covariance) return report;
  const Statistics statistics = solver.statistics();
  bundle = solver.bundle();
  // Each landmark takes one degree of freedom and brings one measurement, the disparity in its host.
  const double freedom = std::max(1.0, statistics.measured - static_cast<double>(covariance->rows()));
  const double noise_scale = std::max(1.0, statistics.chi_square / freedom);
  const Eigen::Index views = 6 * (std::ssize(bundle.T_world_left) - 1);
  report.ok = statistics.inliers > 0;
  report.covariance = noise_scale * covariance->topLeftCorner(views, views);
  if (covariance->rows() > views) {
    report.vergence = learned(bundle.vergence, {bundle.vergence_rad, (*covariance)(views, views)}, 1.0 / noise_scale);
  }
  report.inlier = statistics.inlier;
  report.inliers = statistics.inliers;
  report.rms_px = std::sqrt(statistics.squared_px / std::max(1, statistics.inliers));
  return report;
}

Matrix6d relative_covariance(const Bundle& bundle, const BundleReport& report, int i, int j) {
  const Matrix6d ad = (bundle.T_world_left[j].inverse() * bundle.T_world_left[i]).adjoint();
  const auto block = [&](int a, int b) -> Matrix6d {
    if (a == 0 || b == 0) return Matrix6d::Zero();
    return report.covariance.block<6, 6>(6 * (a - 1), 6 * (b - 1));
  };
  // xi_j - Ad(T_j_i) xi_i
  const Matrix6d cross = block(j, i) * ad.transpose();
  return block(j, j) - cross - cross.transpose() + ad * block(i, i) * ad.transpose();
}

}  // namespace demslam

#include "demslam/graph/pose_graph.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/nonlinear/Marginals.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "demslam/base/error.h"
#include "demslam/base/time.h"
#include "demslam/graph/condensed_past.h"
#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/odometry_factor.h"

namespace demslam {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

gtsam::Key systematic_key(std::size_t stretch) { return gtsam::Symbol('s', stretch); }

gtsam::SharedNoiseModel gaussian(const Matrix6d& covariance) {
  return gtsam::noiseModel::Gaussian::Covariance(covariance);
}

gtsam::SharedNoiseModel systematic_noise(double scale_sigma, double rotation_sigma_deg_per_m) {
  const double rotation_sigma = rotation_sigma_deg_per_m * kRadPerDeg;
  return gtsam::noiseModel::Diagonal::Sigmas(
      gtsam::Vector4(scale_sigma, rotation_sigma, rotation_sigma, rotation_sigma));
}

}  // namespace

struct PoseGraph::State {
  PoseGraphOptions options;
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  std::vector<Pose> poses;
  std::vector<std::size_t> stretch_of;  ///< per keyframe: which systematic state its odometry has
  std::vector<bool> tied;               ///< per keyframe: held by a prior, or by a relative pose to an earlier one
  std::size_t stretches = 0, loops = 0;
  double path_m = 0.0;
  std::vector<std::vector<gtsam::NonlinearFactor::shared_ptr>> factors_from;  ///< by their oldest keyframe
  CondensedPast past;
  mutable std::optional<gtsam::Marginals> marginals;  ///< of the present estimate, once somebody asks

  void add(const gtsam::NonlinearFactor::shared_ptr& factor, std::size_t oldest_keyframe);
  OptimizerReport solve(const gtsam::NonlinearFactorGraph& problem, gtsam::Values initial);
  gtsam::NonlinearFactorGraph window() const;
  /// The systematic state of the measurement that leaves `keyframe`; makes a new one where a stretch ends.
  std::size_t stretch_after(std::size_t keyframe);
  const gtsam::Marginals& present_marginals() const;
  void check_tied() const;
};

void PoseGraph::State::check_tied() const {
  const auto loose = std::find(tied.begin(), tied.end(), false);
  if (loose == tied.end()) return;
  throw Error("pose graph: keyframe " + std::to_string(loose - tied.begin()) +
              " is held by no prior, odometry or loop; add one");
}

std::size_t PoseGraph::State::stretch_after(std::size_t keyframe) {
  const SystematicOptions& s = options.systematic;
  if (stretches > 0 && path_m < static_cast<double>(stretches) * s.stretch_m) return stretches - 1;
  const gtsam::Key key = systematic_key(stretches);
  if (stretches == 0) {
    values.insert(key, gtsam::Vector4(gtsam::Vector4::Zero()));
    add(boost::make_shared<gtsam::PriorFactor<gtsam::Vector4>>(
            key, gtsam::Vector4(gtsam::Vector4::Zero()), systematic_noise(s.scale_sigma, s.rotation_sigma_deg_per_m)),
        keyframe);
  } else {
    const double sqrt_km = std::sqrt(1e-3 * s.stretch_m);
    values.insert(key, values.at<gtsam::Vector4>(systematic_key(stretches - 1)));
    add(boost::make_shared<gtsam::BetweenFactor<gtsam::Vector4>>(
            systematic_key(stretches - 1), key, gtsam::Vector4(gtsam::Vector4::Zero()),
            systematic_noise(s.scale_walk_per_sqrt_km * sqrt_km, s.rotation_walk_deg_per_m_per_sqrt_km * sqrt_km)),
        keyframe);
  }
  return stretches++;
}

void PoseGraph::State::add(const gtsam::NonlinearFactor::shared_ptr& factor, std::size_t oldest_keyframe) {
  marginals.reset();
  factors.push_back(factor);
  factors_from.at(oldest_keyframe).push_back(factor);
}

gtsam::NonlinearFactorGraph PoseGraph::State::window() const {
  gtsam::NonlinearFactorGraph problem = past.factors();
  for (std::size_t k = past.end(); k < factors_from.size(); ++k) problem.push_back(factors_from[k]);
  return problem;
}

OptimizerReport PoseGraph::State::solve(const gtsam::NonlinearFactorGraph& problem, gtsam::Values initial) {
  const Stopwatch watch;
  gtsam::LevenbergMarquardtParams params;
  params.orderingType = gtsam::Ordering::METIS;
  params.maxIterations = options.max_iterations;
  params.relativeErrorTol = 1e-6;
  gtsam::LevenbergMarquardtOptimizer optimizer(problem, initial, params);
  OptimizerReport report{.error_before = optimizer.error(), .factors = problem.size()};
  const gtsam::Values& solution = optimizer.optimize();
  report.error_after = optimizer.error();
  report.iterations = static_cast<int>(optimizer.iterations());
  marginals.reset();
  values.update(solution);
  for (const gtsam::Key key : solution.keys()) {
    if (is_keyframe(key)) poses[key] = from_gtsam(solution.at<gtsam::Pose3>(key));
  }
  report.milliseconds = watch.elapsed_ms();
  return report;
}

const gtsam::Marginals& PoseGraph::State::present_marginals() const {
  if (!marginals) {
    check_tied();
    marginals.emplace(factors, values, gtsam::Ordering::Metis(factors));
  }
  return *marginals;
}

PoseGraph::PoseGraph(const PoseGraphOptions& options) : state_(std::make_unique<State>()) { state_->options = options; }
PoseGraph::~PoseGraph() = default;
PoseGraph::PoseGraph(PoseGraph&&) noexcept = default;

std::size_t PoseGraph::add_keyframe(const Pose& T_map_body) {
  state_->marginals.reset();
  state_->values.insert(gtsam::Key(size()), to_gtsam(T_map_body));
  state_->stretch_of.push_back(state_->stretches == 0 ? 0 : state_->stretches - 1);
  state_->poses.push_back(T_map_body);
  state_->factors_from.emplace_back();
  state_->tied.push_back(false);
  return size() - 1;
}

void PoseGraph::add_factor(const boost::shared_ptr<gtsam::NonlinearFactor>& factor) {
  std::size_t oldest = size();
  for (const gtsam::Key key : factor->keys()) {
    if (is_keyframe(key)) oldest = std::min<std::size_t>(oldest, key);
  }
  state_->add(factor, oldest);
}

void PoseGraph::add_prior(std::size_t keyframe, const Pose& T_map_body, const Matrix6d& covariance) {
  state_->tied.at(keyframe) = true;
  add_factor(
      boost::make_shared<gtsam::PriorFactor<gtsam::Pose3>>(keyframe, to_gtsam(T_map_body), gaussian(covariance)));
}

void PoseGraph::add_odometry(const RelativePose& m) {
  state_->tied.at(m.j) = true;
  if (!state_->options.systematic.enabled) {
    add_factor(
        boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(m.i, m.j, to_gtsam(m.T_i_j), gaussian(m.covariance)));
    return;
  }
  const std::size_t stretch = state_->stretch_after(m.i);
  state_->path_m += m.T_i_j.translation().norm();
  state_->stretch_of[m.j] = stretch;
  add_factor(
      boost::make_shared<SystematicOdometryFactor>(m.i, m.j, systematic_key(stretch), m.T_i_j, gaussian(m.covariance)));
}

void PoseGraph::add_loop(const RelativePose& m) {
  state_->tied.at(m.j) = true;
  const auto kernel = gtsam::noiseModel::mEstimator::Cauchy::Create(state_->options.loop_kernel_sigmas);
  const auto noise = gtsam::noiseModel::Robust::Create(kernel, gaussian(m.covariance));
  add_factor(boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(m.i, m.j, to_gtsam(m.T_i_j), noise));
  ++state_->loops;
}

OptimizerReport PoseGraph::optimize() {
  state_->check_tied();
  state_->past = {};
  return state_->solve(state_->factors, state_->values);
}

OptimizerReport PoseGraph::optimize_window(std::size_t first) {
  state_->check_tied();
  state_->past.extend_to(first, state_->factors_from, state_->values);
  const gtsam::NonlinearFactorGraph problem = state_->window();
  return state_->solve(problem, values_of(problem.keys(), state_->values));
}

std::size_t PoseGraph::size() const { return state_->poses.size(); }
std::size_t PoseGraph::loops() const { return state_->loops; }
const Pose& PoseGraph::T_map_body(std::size_t keyframe) const { return state_->poses.at(keyframe); }

SystematicErrors PoseGraph::systematic_errors(std::size_t keyframe) const {
  if (state_->stretches == 0) return {};
  const auto s = state_->values.at<gtsam::Vector4>(systematic_key(state_->stretch_of.at(keyframe)));
  return {.scale = s[0], .rotation_rad_per_m = s.tail<3>()};
}

Pose PoseGraph::corrected_odometry(const RelativePose& measurement) const {
  const SystematicErrors errors = systematic_errors(measurement.i);
  Vector4d s;
  s << errors.scale, errors.rotation_rad_per_m;
  return corrected(measurement.T_i_j, s);
}

std::vector<Matrix6d> PoseGraph::covariances(const std::vector<std::size_t>& keyframes) const {
  std::vector<Matrix6d> result;
  for (const std::size_t k : keyframes) result.emplace_back(state_->present_marginals().marginalCovariance(k));
  return result;
}

Matrix6d PoseGraph::newest_covariance() const {
  const gtsam::NonlinearFactorGraph problem = state_->window();
  const gtsam::Marginals marginals(problem, values_of(problem.keys(), state_->values), gtsam::Ordering::Metis(problem));
  return marginals.marginalCovariance(size() - 1);
}

Matrix6d PoseGraph::relative_covariance(std::size_t i, std::size_t j) const {
  const gtsam::JointMarginal joint = state_->present_marginals().jointMarginalCovariance({i, j});
  const Matrix6d A = (T_map_body(j).inverse() * T_map_body(i)).adjoint();  // d T_i_j = d T_j - Ad(T_j_i) d T_i
  const Matrix6d cross = A * joint.at(i, j);
  return joint.at(j, j) + A * joint.at(i, i) * A.transpose() - cross - cross.transpose();
}

double PoseGraph::chi_square(const RelativePose& m) const {
  const Pose T_i_j = T_map_body(m.i).inverse() * T_map_body(m.j);
  const Vector6d deviation = (m.T_i_j.inverse() * T_i_j).log();
  const Matrix6d total = relative_covariance(m.i, m.j) + m.covariance;
  return deviation.dot(total.ldlt().solve(deviation));
}

}  // namespace demslam

#include "demslam/graph/pose_graph.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "demslam/base/error.h"
#include "demslam/base/time.h"
#include "demslam/geometry/angle.h"
#include "demslam/graph/elimination_order.h"
#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

gtsam::SharedNoiseModel gaussian(const Matrix6d& covariance) {
  return gtsam::noiseModel::Gaussian::Covariance(covariance);
}

Vector4d systematic_sigmas(double scale_sigma, double rotation_sigma_deg_per_m) {
  const double rotation_sigma = rotation_sigma_deg_per_m * kRadPerDeg;
  return {scale_sigma, rotation_sigma, rotation_sigma, rotation_sigma};
}

gtsam::SharedNoiseModel systematic_noise(double scale_sigma, double rotation_sigma_deg_per_m) {
  return gtsam::noiseModel::Diagonal::Sigmas(systematic_sigmas(scale_sigma, rotation_sigma_deg_per_m));
}

}  // namespace

gtsam::Key systematic_key(std::size_t stretch) { return gtsam::Symbol('s', stretch); }

void PoseGraph::State::check_tied() const {
  const auto loose = std::find(tied.begin(), tied.end(), false);
  if (loose == tied.end()) return;
  throw Error("pose graph: keyframe " + std::to_string(loose - tied.begin()) +
              " is held by no prior, odometry or loop; add one");
}

std::size_t PoseGraph::State::stretch_after(std::size_t keyframe) {
  const SystematicOptions& s = options.systematic;
  if (stretches > 0 && chain.path_m(keyframe) < static_cast<double>(stretches) * s.stretch_m) return stretches - 1;
  const gtsam::Key key = systematic_key(stretches);
  values.insert(key, systematic(stretches == 0 ? 0 : stretches - 1));
  if (stretches == 0) {
    const Vector4d sigmas = systematic_sigmas(s.scale_sigma, s.rotation_sigma_deg_per_m);
    systematic_covariance = sigmas.cwiseAbs2().asDiagonal();
    factors.add(boost::make_shared<gtsam::PriorFactor<gtsam::Vector4>>(key, gtsam::Vector4(gtsam::Vector4::Zero()),
                                                                       gtsam::noiseModel::Diagonal::Sigmas(sigmas)),
                keyframe);
  } else {
    const double sqrt_km = std::sqrt(1e-3 * s.stretch_m);
    factors.add(
        boost::make_shared<gtsam::BetweenFactor<gtsam::Vector4>>(
            systematic_key(stretches - 1), key, gtsam::Vector4(gtsam::Vector4::Zero()),
            systematic_noise(s.scale_walk_per_sqrt_km * sqrt_km, s.rotation_walk_deg_per_m_per_sqrt_km * sqrt_km)),
        keyframe);
  }
  return stretches++;
}

Vector4d PoseGraphProblem::systematic(std::size_t stretch) const {
  return stretches == 0 ? Vector4d::Zero() : values.at<gtsam::Vector4>(systematic_key(stretch));
}

void PoseGraphProblem::add(const FactorTable::Factor& factor) {
  std::size_t oldest = poses.size();
  for (const gtsam::Key key : factor->keys()) {
    if (!is_keyframe(key)) continue;
    oldest = std::min<std::size_t>(oldest, key);
    if (folded.at(key)) unfold(key);
    held[key] = true;
  }
  factors.add(factor, oldest);
}

FactorTable::Factor PoseGraphProblem::link(std::size_t a, std::size_t b) const {
  const std::size_t stretch = stretch_of[b];
  const Vector4d s = systematic(stretch);
  const CompoundMotion motion = chain.compound(a, b, s);
  const auto noise = gaussian(motion.covariance);
  if (!options.systematic.enabled)
    return boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(a, b, to_gtsam(motion.T_a_b), noise);
  if (b == a + 1)
    return boost::make_shared<SystematicOdometryFactor>(a, b, systematic_key(stretch), chain.measured(b), noise);
  return boost::make_shared<CompoundOdometryFactor>(a, b, systematic_key(stretch), motion.T_a_b, motion.by_systematic,
                                                    s, noise);
}

gtsam::NonlinearFactorGraph PoseGraphProblem::factor_graph() const {
  gtsam::NonlinearFactorGraph graph = past.factors();
  factors.append_to(graph, past.end(), factors.size());
  return graph;
}

OptimizerReport PoseGraphProblem::solve(int max_iterations, double relative_tolerance) {
  const Stopwatch watch;
  const gtsam::NonlinearFactorGraph graph = factor_graph();
  gtsam::LevenbergMarquardtParams params;
  params.maxIterations = max_iterations;
  params.relativeErrorTol = relative_tolerance;
  gtsam::LevenbergMarquardtOptimizer optimizer(graph, values_of(graph.keys(), values), nested_dissection(graph),
                                               params);
  OptimizerReport report{.error_before = optimizer.error(), .factors = graph.size()};
  const gtsam::Values& solution = optimizer.optimize();
  report.error_after = optimizer.error();
  report.iterations = static_cast<int>(optimizer.iterations());
  report.variables = solution.size();
  move_to(solution);
  report.milliseconds = watch.elapsed_ms();
  return report;
}

void PoseGraphProblem::move_to(const gtsam::Values& solution) {
  values.update(solution);
  for (const gtsam::Key key : solution.keys()) {
    if (is_keyframe(key)) poses[key] = from_gtsam(solution.at<gtsam::Pose3>(key));
  }
  place_folded(past.end() == 0 ? 0 : held_before(past.end()));
}

PoseGraph::PoseGraph(const PoseGraphOptions& options, BatchLauncher launch) : state_(std::make_unique<State>()) {
  state_->options = options;
  state_->launch = std::move(launch);
}
PoseGraph::~PoseGraph() = default;
PoseGraph::PoseGraph(PoseGraph&&) noexcept = default;

std::size_t PoseGraph::add_keyframe(const Pose& T_map_body) {
  State& s = *state_;
  s.values.insert(gtsam::Key(size()), to_gtsam(T_map_body));
  s.stretch_of.push_back(s.stretches == 0 ? 0 : s.stretches - 1);
  s.poses.push_back(T_map_body);
  s.factors.add_keyframe();
  s.chain.add_keyframe();
  for (auto* flags : {&s.tied, &s.held, &s.folded}) flags->push_back(false);
  return size() - 1;
}

void PoseGraph::add_factor(const boost::shared_ptr<gtsam::NonlinearFactor>& factor) { state_->add(factor); }

void PoseGraph::add_prior(std::size_t keyframe, const Pose& T_map_body, const Matrix6d& covariance) {
  State& s = *state_;
  if (!s.tied.at(keyframe) && (s.known.empty() || s.known.back().keyframe < keyframe))
    s.known.push_back({keyframe, covariance});
  s.tied[keyframe] = true;
  s.add(boost::make_shared<gtsam::PriorFactor<gtsam::Pose3>>(keyframe, to_gtsam(T_map_body), gaussian(covariance)));
}

void PoseGraph::add_odometry(const RelativePose& m) {
  State& s = *state_;
  s.tied.at(m.j) = true;
  const bool is_link = m.j == size() - 1 && m.i + 1 == m.j && !s.chain.linked(m.j);
  if (s.options.systematic.enabled) s.stretch_of[m.j] = s.stretch_after(m.i);
  if (is_link) {
    s.chain.link(m.T_i_j, m.covariance);
    s.factors.set_link(s.link(m.i, m.j), m.i);
  } else if (s.options.systematic.enabled) {
    s.add(boost::make_shared<SystematicOdometryFactor>(m.i, m.j, systematic_key(s.stretch_of[m.j]), m.T_i_j,
                                                       gaussian(m.covariance)));
  } else {
    s.add(boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(m.i, m.j, to_gtsam(m.T_i_j), gaussian(m.covariance)));
  }
}

std::uint64_t PoseGraph::add_shared(const Eigen::Vector3d& sigma) {
  State& s = *state_;
  const gtsam::Key key = gtsam::Symbol('v', s.shared++);
  s.values.insert(key, gtsam::Vector3(gtsam::Vector3::Zero()));
  s.factors.add(boost::make_shared<gtsam::PriorFactor<gtsam::Vector3>>(key, gtsam::Vector3(gtsam::Vector3::Zero()),
                                                                       gtsam::noiseModel::Diagonal::Sigmas(sigma)),
                size() - 1);
  s.factors.keep(key);
  return key;
}

void PoseGraph::move(std::size_t first, const Pose& T_correction) {
  State& s = *state_;
  s.past = {};
  s.under_way.reset();
  for (std::size_t k = first; k < size(); ++k) {
    s.poses[k] = T_correction * s.poses[k];
    if (s.values.exists(k)) s.values.update(gtsam::Key(k), to_gtsam(s.poses[k]));
  }
}

Eigen::Vector3d PoseGraph::shared(std::uint64_t key) const { return state_->values.at<gtsam::Vector3>(key); }
std::size_t PoseGraph::size() const { return state_->poses.size(); }
std::size_t PoseGraph::variables() const { return state_->values.size(); }
std::size_t PoseGraph::batches() const { return state_->batches; }
double PoseGraph::path_m(std::size_t keyframe) const { return state_->chain.path_m(keyframe); }
const Pose& PoseGraph::T_map_body(std::size_t keyframe) const { return state_->poses.at(keyframe); }

SystematicErrors PoseGraph::systematic_errors(std::size_t keyframe) const {
  const Vector4d s = state_->systematic(state_->stretch_of.at(keyframe));
  return {.scale = s[0], .rotation_rad_per_m = s.tail<3>()};
}

Pose PoseGraph::corrected_odometry(const RelativePose& measurement) const {
  return corrected(measurement.T_i_j, state_->systematic(state_->stretch_of.at(measurement.i)));
}

}  // namespace demslam

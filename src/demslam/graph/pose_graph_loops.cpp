#include <gtsam/linear/GaussianFactorGraph.h>
#include <gtsam/linear/JacobianFactor.h>
#include <gtsam/slam/BetweenFactor.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "demslam/graph/clique_covariance.h"
#include "demslam/graph/gtsam_pose.h"
#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

constexpr int kGraduatedIterations = 5;  // of Levenberg-Marquardt, per step of the non-convexity
constexpr double kNoKernel = 0.999999;   // as good as 1
constexpr double kFirstMu = 1e-4, kLastMu = 1e3, kGraduation = 2.0;
constexpr double kMedianOfSix = 5.348;         // chi-square of 6 degrees of freedom
constexpr std::size_t kEnoughForAMedian = 10;  // loops
constexpr double kToldByNobody = 1e-7;         // share of all others in what is known along a direction

/// Truncated least squares in graduated non-convexity: the weight of a squared residual at a control parameter mu.
/// Yang, Antonante, Tzoumas, Carlone: Graduated Non-Convexity for Robust Spatial Perception (2020), equation 14.
double truncated_weight(double squared, double gate, double mu) {
  if (squared >= (mu + 1.0) / mu * gate) return 0.0;
  if (squared <= mu / (mu + 1.0) * gate) return 1.0;
  return std::sqrt(gate * mu * (mu + 1.0) / squared) - mu;
}

/// A loop's measurements, linearised and whitened: r + A x + B d, with x the perturbations of its keyframes and d a
/// displacement of the place as a whole, in the body of the first keyframe j.
struct LinearLoop {
  std::map<gtsam::Key, Eigen::Index> columns;  ///< where the perturbation of a keyframe begins in x
  gtsam::Matrix A, B;
  gtsam::Vector r;

  LinearLoop(const std::vector<RelativePose>& measurements, const std::vector<Pose>& T_map_body,
             const gtsam::VectorValues& x);
  gtsam::Matrix covariance(const CliqueCovariance& joint) const;
  /// Chi-square (6 degrees of freedom) of d, given the covariance P of x: Baarda's test of a group of observations.
  double displacement(const gtsam::Matrix& P, bool is_in_the_graph) const;
};

LinearLoop::LinearLoop(const std::vector<RelativePose>& measurements, const std::vector<Pose>& T_map_body,
                       const gtsam::VectorValues& x) {
  for (const RelativePose& m : measurements)
    for (const std::size_t k : {m.i, m.j}) columns.emplace(k, 6 * std::ssize(columns));
  const auto rows = 6 * std::ssize(measurements);
  A = gtsam::Matrix::Zero(rows, 6 * std::ssize(columns));
  B = gtsam::Matrix::Zero(rows, 6);
  r = gtsam::Vector::Zero(rows);
  const Pose& T_map_first = T_map_body[measurements.front().j];
  for (Eigen::Index row = 0; const RelativePose& m : measurements) {
    const Pose T_i_j = T_map_body[m.i].inverse() * T_map_body[m.j];
    const Matrix6d by_i = T_i_j.inverse().adjoint();
    const Matrix6d whiten = Matrix6d(m.covariance.llt().matrixL()).inverse();
    A.block<6, 6>(row, columns.at(m.i)) = -whiten * by_i;
    A.block<6, 6>(row, columns.at(m.j)) = whiten;
    B.middleRows<6>(row) = whiten * (T_map_body[m.j].inverse() * T_map_first).adjoint();
    r.segment<6>(row) = whiten * ((m.T_i_j.inverse() * T_i_j).log() + x.at(m.j) - by_i * x.at(m.i));
    row += 6;
  }
}

gtsam::Matrix LinearLoop::covariance(const CliqueCovariance& joint) const {
  gtsam::Matrix P(A.cols(), A.cols());
  for (const auto& [a, row] : columns)
    for (const auto& [b, column] : columns) P.block<6, 6>(row, column) = joint.block(a, b);
  return P;
}

double LinearLoop::displacement(const gtsam::Matrix& P, bool is_in_the_graph) const {
  const gtsam::Matrix information = A.transpose() * A, across = B.transpose() * A;
  const gtsam::Matrix I = gtsam::Matrix::Identity(P.rows(), P.cols());
  const gtsam::Matrix with_loop = is_in_the_graph ? P : gtsam::Matrix((I + P * information).lu().solve(P));
  const gtsam::Vector weighted = is_in_the_graph ? r : gtsam::Vector(r - A * (with_loop * (A.transpose() * r)));
  const Eigen::LLT<Matrix6d> scale(Matrix6d(B.transpose() * B));
  const Matrix6d half = scale.matrixL().solve(Matrix6d(across * with_loop * across.transpose()));
  const Eigen::SelfAdjointEigenSolver<Matrix6d> told_by_loop(Matrix6d(scale.matrixL().solve(half.transpose())));
  const Vector6d along =
      told_by_loop.eigenvectors().transpose() * scale.matrixL().solve(Vector6d(B.transpose() * weighted));
  double chi_square = 0.0;
  for (int k = 0; k < 6; ++k) {
    const double told_by_others = 1.0 - told_by_loop.eigenvalues()[k];
    if (told_by_others > kToldByNobody) chi_square += along[k] * along[k] / told_by_others;
  }
  return chi_square;
}

bool holds_all(const CliqueCovariance& joint, const std::vector<RelativePose>& measurements) {
  return std::ranges::all_of(measurements, [&](const RelativePose& m) { return joint.holds(m.i) && joint.holds(m.j); });
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

std::size_t PoseGraph::loops() const { return state_->loops.size(); }
bool PoseGraph::loop_is_on(std::size_t loop) const { return state_->loops.at(loop).is_on(); }

std::size_t PoseGraph::add_loop(std::vector<RelativePose> measurements) {
  State& s = *state_;
  for (const RelativePose& m : measurements) s.tied.at(m.j) = true;
  s.loops.push_back({std::make_shared<const std::vector<RelativePose>>(std::move(measurements)), {}});
  s.weigh(s.loops.back(), 1.0);
  ++s.loops_waiting;
  return s.loops.size() - 1;
}

double PoseGraphProblem::misfit(const Loop& loop) const {
  double sum = 0.0;
  for (const RelativePose& m : *loop.measurements) {
    const Vector6d deviation = (m.T_i_j.inverse() * poses[m.i].inverse() * poses[m.j]).log();
    sum += deviation.dot(m.covariance.ldlt().solve(deviation));
  }
  return sum / static_cast<double>(loop.measurements->size());
}

void PoseGraphProblem::weigh(Loop& loop, double weight) {
  for (const auto& factor : loop.factors) factors.remove(factor, std::min(factor->keys()[0], factor->keys()[1]));
  loop.factors.clear();
  if (weight <= 0.0) return;
  for (const RelativePose& m : *loop.measurements) {
    const gtsam::SharedNoiseModel gaussian = gtsam::noiseModel::Gaussian::Covariance(m.covariance / weight);
    const auto cauchy = gtsam::noiseModel::mEstimator::Cauchy::Create(options.loop_kernel_sigmas);
    const auto robust = gtsam::noiseModel::Robust::Create(cauchy, gaussian);
    const gtsam::SharedNoiseModel noise = weight == 1.0 ? gtsam::SharedNoiseModel(robust) : gaussian;
    loop.factors.push_back(boost::make_shared<gtsam::BetweenFactor<gtsam::Pose3>>(m.i, m.j, to_gtsam(m.T_i_j), noise));
    add(loop.factors.back());
  }
}

std::vector<bool> PoseGraphProblem::loops_on() const {
  std::vector<bool> on;
  for (const Loop& loop : loops) on.push_back(loop.is_on());
  return on;
}

bool PoseGraphProblem::loops_fit() const {
  return std::ranges::all_of(loops,
                             [&](const Loop& loop) { return loop.is_on() == (misfit(loop) <= options.loop_gate); });
}

void PoseGraphProblem::graduate() {
  std::vector<double> squared(loops.size());
  const auto solve_and_look = [&] {
    solve(kGraduatedIterations);
    std::ranges::transform(loops, squared.begin(), [&](const Loop& loop) { return misfit(loop); });
  };
  for (Loop& loop : loops) weigh(loop, kNoKernel);
  solve_and_look();
  const double largest = std::ranges::max(squared);
  for (double mu = std::max(kFirstMu, options.loop_gate / (2.0 * largest)); mu < kLastMu; mu *= kGraduation) {
    bool binary = true;
    for (std::size_t l = 0; l < loops.size(); ++l) {
      const double weight = truncated_weight(squared[l], options.loop_gate, mu);
      binary = binary && (weight < 1e-3 || weight > 0.999);
      weigh(loops[l], weight < 1e-3 ? 0.0 : std::min(weight, kNoKernel));
    }
    solve_and_look();
    if (binary) break;
  }
  for (std::size_t l = 0; l < loops.size(); ++l) weigh(loops[l], squared[l] <= options.loop_gate ? kNoKernel : 0.0);
}

std::vector<double> PoseGraphProblem::against_the_rest() const {
  gtsam::GaussianFactorGraph graph = *factor_graph().linearize(values);
  std::unordered_multimap<gtsam::Key, std::size_t> loops_at;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    std::map<gtsam::Key, gtsam::Matrix> nothing;  // says nothing of its keyframes, and makes them one clique
    for (const RelativePose& m : *loops[l].measurements)
      for (const std::size_t k : {m.i, m.j}) nothing.emplace(k, gtsam::Matrix::Zero(1, 6));
    for (const auto& [key, zero] : nothing) loops_at.emplace(key, l);
    graph.emplace_shared<gtsam::JacobianFactor>(nothing, gtsam::Vector::Zero(1));
  }
  const auto tree = eliminated(graph);
  const gtsam::VectorValues step = tree->optimize();
  std::vector<double> chi_squares(loops.size());
  std::vector<bool> tested(loops.size());
  for_each_clique(*tree, [&](const auto& conditional, const CliqueCovariance& joint) {
    for (const gtsam::Key key : conditional.frontals()) {
      for (auto [at, end] = loops_at.equal_range(key); at != end; ++at) {
        const std::size_t l = at->second;
        if (tested[l] || !holds_all(joint, *loops[l].measurements)) continue;
        const LinearLoop loop(*loops[l].measurements, poses, step);
        chi_squares[l] = loop.displacement(loop.covariance(joint), loops[l].is_on());
        tested[l] = true;
      }
    }
  });
  return chi_squares;
}

double PoseGraphProblem::gate_of(const std::vector<double>& chi_squares) const {
  std::vector<double> on;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    if (loops[l].is_on()) on.push_back(chi_squares[l]);
  }
  const double variance = on.size() < kEnoughForAMedian ? 1.0 : median(std::move(on)) / kMedianOfSix;
  return options.loop_gate * std::max(1.0, variance);
}

bool PoseGraphProblem::leave_out_the_worst(const std::vector<double>& chi_squares) {
  double worst = gate_of(chi_squares);
  Loop* loop = nullptr;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    if (!loops[l].is_on() || chi_squares[l] <= worst) continue;
    worst = chi_squares[l];
    loop = &loops[l];
  }
  if (loop != nullptr) weigh(*loop, 0.0);
  return loop != nullptr;
}

bool PoseGraphProblem::take_back(const std::vector<double>& chi_squares) {
  const double gate = gate_of(chi_squares);
  bool any = false;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    if (loops[l].is_on() || chi_squares[l] > gate) continue;
    weigh(loops[l], kNoKernel);
    any = true;
  }
  return any;
}

bool PoseGraphProblem::snoop() {
  for (bool taken_back = false, any = false;; any = true) {
    const std::vector<double> chi_squares = against_the_rest();
    bool changed = leave_out_the_worst(chi_squares);
    if (!changed && !taken_back) {
      taken_back = true;
      changed = take_back(chi_squares);
    }
    if (!changed) return any;
    solve(kGraduatedIterations);
  }
}

bool PoseGraphProblem::sort_out_loops() {
  const bool fit = loops_fit();
  if (fit) {
    for (Loop& loop : loops) weigh(loop, loop.is_on() ? kNoKernel : 0.0);
  } else {
    graduate();
    solve(kGraduatedIterations);
  }
  const bool changed = snoop();
  for (Loop& loop : loops) weigh(loop, loop.is_on() ? 1.0 : 0.0);
  return !fit || changed;
}

}  // namespace demslam

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "demslam/base/error.h"
#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

/// Moves the covariance of T_map_a to b, rigidly.
Matrix6d moved(const Matrix6d& covariance, const Pose& T_b_a) {
  const Matrix6d A = T_b_a.adjoint();
  return A * covariance * A.transpose();
}

/// Chi-square of a measurement against a prediction of the same motion.
double distance(const RelativePose& m, const Pose& T_i_j, const Matrix6d& covariance) {
  const Vector6d deviation = (m.T_i_j.inverse() * T_i_j).log();
  return deviation.dot((covariance + m.covariance).ldlt().solve(deviation));
}

/// Marginals of unfolded keyframes, and the joint one of those on both sides of folded ones.
struct Marginals {
  std::map<std::size_t, Matrix6d> of;
  std::map<std::size_t, Eigen::Matrix<double, 12, 12>> across;  ///< by the first of the two
};

}  // namespace

void PoseGraph::State::note_newest() {
  const std::size_t newest = poses.size() - 1;
  const gtsam::Key state = gtsam::Symbol('s', stretch_of[newest]);
  for_each_clique(*eliminated(*factor_graph().linearize(values)),
                  [&](const auto& conditional, const CliqueCovariance& covariance) {
                    for (const gtsam::Key key : conditional.frontals()) {
                      if (key == state) systematic_covariance = covariance.block(key, key);
                      if (key != newest) continue;
                      if (!known.empty() && known.back().keyframe == newest) known.pop_back();
                      known.push_back({newest, covariance.block(key, key)});
                    }
                  });
}

gtsam::GaussianBayesTree::shared_ptr PoseGraph::State::linearized() const {
  gtsam::NonlinearFactorGraph everything;
  factors.append_to(everything, 0, factors.size());
  return eliminated(*everything.linearize(values));
}

std::optional<Matrix6d> PoseGraph::State::known_covariance(std::size_t keyframe) const {
  const auto after = std::upper_bound(known.begin(), known.end(), keyframe,
                                      [](std::size_t k, const Known& entry) { return k < entry.keyframe; });
  if (after == known.begin()) return std::nullopt;
  const Known& last = *(after - 1);
  if (last.keyframe == keyframe) return last.covariance;
  const auto since = chain.covariance(last.keyframe, keyframe, systematic_covariance);
  if (!since) return std::nullopt;
  return moved(last.covariance, poses[keyframe].inverse() * poses[last.keyframe]) + *since;
}

Matrix6d PoseGraph::newest_covariance() const {
  const auto known = state_->known_covariance(size() - 1);
  return known ? *known : covariances({size() - 1}).front();
}

std::optional<Matrix6d> PoseGraph::odometry_covariance(std::size_t i, std::size_t j) const {
  return state_->chain.covariance(i, j, state_->systematic_covariance);
}

std::optional<Matrix6d> PoseGraph::odometry_bend(std::size_t a, std::size_t m, std::size_t b) const {
  return state_->chain.bend(a, m, b, state_->systematic_covariance);
}

Matrix6d PoseGraph::relative_covariance(std::size_t i, std::size_t j) const {
  const State& s = *state_;
  const auto by_odometry = odometry_covariance(i, j);
  const auto of_i = s.known_covariance(i), of_j = s.known_covariance(j);
  std::optional<Matrix6d> apart;
  const auto sum = [&](const Matrix6d& at_i, const Matrix6d& at_j) -> Matrix6d {
    return moved(at_i, s.poses[j].inverse() * s.poses[i]) + at_j;
  };
  if (of_i && of_j) apart = sum(*of_i, *of_j);
  if (by_odometry && apart) return by_odometry->determinant() < apart->determinant() ? *by_odometry : *apart;
  if (by_odometry) return *by_odometry;
  if (apart) return *apart;
  const std::vector<Matrix6d> both = covariances({i, j});  // off the chain, as behind a loss: the whole graph is asked
  return sum(both[0], both[1]);
}

double PoseGraph::chi_square(const RelativePose& m) const {
  return distance(m, T_map_body(m.i).inverse() * T_map_body(m.j), relative_covariance(m.i, m.j));
}

std::optional<double> PoseGraph::odometry_chi_square(const RelativePose& m) const {
  const State& s = *state_;
  const auto covariance = odometry_covariance(m.i, m.j);
  if (!covariance) return std::nullopt;
  return distance(m, s.chain.motion(m.i, m.j, s.systematic(s.stretch_of[m.j])), *covariance);
}

Eigen::Matrix3d PoseGraph::shared_covariance(std::uint64_t key) const {
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for_each_clique(*state_->linearized(), [&](const auto&, const CliqueCovariance& covariance) {
    if (covariance.holds(key)) result = covariance.block(key, key);
  });
  return result;
}

std::vector<Matrix6d> PoseGraph::covariances(const std::vector<std::size_t>& keyframes) const {
  const State& s = *state_;
  s.check_tied();
  Marginals marginals;
  for (const std::size_t k : keyframes)
    s.folded.at(k) ? (void)marginals.across[s.held_before(k)] : (void)marginals.of[k];
  const auto keep_across = [&](const CliqueCovariance& covariance, std::size_t a) {
    const auto wanted = marginals.across.find(a);
    if (wanted == marginals.across.end()) return;
    const std::size_t b = s.held_after(a);
    if (!covariance.holds(a) || !covariance.holds(b)) return;
    wanted->second << covariance.block(a, a), covariance.block(a, b), covariance.block(b, a), covariance.block(b, b);
  };
  for_each_clique(*s.linearized(), [&](const auto& conditional, const CliqueCovariance& covariance) {
    for (const gtsam::Key key : conditional.frontals()) {
      if (!is_keyframe(key)) continue;
      if (const auto wanted = marginals.of.find(key); wanted != marginals.of.end())
        wanted->second = covariance.block(key, key);
      keep_across(covariance, key);
      if (key > 0) keep_across(covariance, s.held_before(key));
    }
  });
  std::vector<Matrix6d> result;
  for (const std::size_t k : keyframes) {
    if (!s.folded[k]) {
      result.push_back(marginals.of.at(k));
      continue;
    }
    const std::size_t a = s.held_before(k), b = s.held_after(k);
    const auto dependence = s.chain.dependence(a, k, b, s.systematic(s.stretch_of[b]));
    Eigen::Matrix<double, 6, 12> by_both;
    by_both << dependence.by_a, dependence.by_b;
    result.push_back(by_both * marginals.across.at(a) * by_both.transpose() + dependence.remainder);
  }
  return result;
}

}  // namespace demslam

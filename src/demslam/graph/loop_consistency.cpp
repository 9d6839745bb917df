#include "demslam/graph/loop_consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <optional>

namespace demslam {
namespace {

Matrix6d moved(const Matrix6d& covariance, const Pose& T_b_a) {
  const Matrix6d A = T_b_a.adjoint();
  return A * covariance * A.transpose();
}

/// The graph's T_a_b over a short way, its covariance by odometry, in either direction.
std::optional<RelativePose> way(const PoseGraph& graph, std::size_t a, std::size_t b) {
  RelativePose result{a, b, graph.T_map_body(a).inverse() * graph.T_map_body(b), Matrix6d::Zero()};
  if (a == b) return result;
  const auto covariance = graph.odometry_covariance(std::min(a, b), std::max(a, b));
  if (!covariance) return std::nullopt;
  result.covariance = a < b ? *covariance : moved(*covariance, result.T_i_j.inverse());
  return result;
}

}  // namespace

double loops_apart(const PoseGraph& graph, const RelativePose& first, const RelativePose& second) {
  const auto before = way(graph, second.i, first.i), after = way(graph, first.j, second.j);
  if (!before || !after) return std::numeric_limits<double>::infinity();
  const Pose T_j1_j2 = after->T_i_j, T_i1_j2 = first.T_i_j * T_j1_j2;
  const Vector6d deviation = (second.T_i_j.inverse() * before->T_i_j * T_i1_j2).log();
  const Matrix6d total = moved(before->covariance, T_i1_j2.inverse()) + moved(first.covariance, T_j1_j2.inverse()) +
                         after->covariance + second.covariance;
  return deviation.dot(total.ldlt().solve(deviation));
}

}  // namespace demslam

#include "demslam/evaluation/alignment.h"

#include <Eigen/SVD>
#include <limits>

#include "demslam/evaluation/trajectory_io.h"

namespace demslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d mean(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

std::optional<Similarity> align_first_pose(const PosePairs& pairs) {
  if (!has_rotation(pairs.truth)) return std::nullopt;
  const Pose T = pairs.truth.front().pose * pairs.estimate.front().pose.inverse();
  return Similarity{T.rotation_matrix(), T.translation()};
}

}  // namespace

std::string_view title_of(Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return "no alignment";
    case Alignment::first_pose:
      return "first pose aligned";
    case Alignment::se3:
      return "SE(3) Umeyama alignment";
    case Alignment::sim3:
      return "Sim(3) Umeyama alignment";
  }
  return "";
}

std::string_view name_of(Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return "none";
    case Alignment::first_pose:
      return "first-pose";
    case Alignment::se3:
      return "se3";
    case Alignment::sim3:
      return "sim3";
  }
  return "";
}

std::optional<Similarity> umeyama(const Points& source, const Points& target, bool with_scale) {
  const Eigen::Vector3d mean_source = mean(source), mean_target = mean(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_source = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    covariance += (target[i] - mean_target) * (source[i] - mean_source).transpose();
    variance_source += (source[i] - mean_source).squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (source.size() < 3 || d(1) <= std::numeric_limits<double>::epsilon() * std::max(d(0), 1.0)) return std::nullopt;
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) s(2) = -1.0;  // a rotation, no mirror image
  Similarity S{.R = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose()};
  if (with_scale) S.scale = d.dot(s) / variance_source;
  S.t = mean_target - S.scale * (S.R * mean_source);
  return S;
}

std::optional<Similarity> align(const PosePairs& pairs, Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return Similarity{};
    case Alignment::first_pose:
      return align_first_pose(pairs);
    default:
      return umeyama(positions(pairs.estimate), positions(pairs.truth), alignment == Alignment::sim3);
  }
}

Points positions(const Trajectory& trajectory) {
  Points points;
  for (const StampedPose& stamped : trajectory) points.push_back(stamped.pose.translation());
  return points;
}

}  // namespace demslam

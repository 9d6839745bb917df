#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

#include "demslam/evaluation/association.h"

namespace demslam {

enum class Alignment {
  none,
  first_pose,  ///< the first estimated pose is moved onto the first true one
  se3,         ///< Umeyama without scale
  sim3,        ///< Umeyama with scale
};

/// As titles name it: "no alignment", "first pose aligned", "SE(3) Umeyama alignment", ...
std::string_view title_of(Alignment alignment);
/// As files and command lines name it: "none", "first-pose", "se3", "sim3".
std::string_view name_of(Alignment alignment);

/// p_target = scale * R * p_source + t.
struct Similarity {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  double scale = 1.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return scale * (R * p) + t; }
};

/// Least-squares similarity of matched points (Umeyama 1991). Nothing when the points lie on one line or in one place:
/// then the rotation is not determined.
std::optional<Similarity> umeyama(const std::vector<Eigen::Vector3d>& source,
                                  const std::vector<Eigen::Vector3d>& target, bool with_scale);

/// The transform that moves the estimate onto the truth. Nothing where it is not determined: degenerate positions, or
/// `first_pose` with a truth that has no rotations.
std::optional<Similarity> align(const PosePairs& pairs, Alignment alignment);

std::vector<Eigen::Vector3d> positions(const Trajectory& trajectory);

}  // namespace demslam

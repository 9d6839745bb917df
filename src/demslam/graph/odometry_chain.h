#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "demslam/geometry/pose.h"
#include "demslam/graph/odometry_factor.h"
#include "demslam/graph/shared_history.h"

namespace demslam {

/// Several measured motions as one: T_a_b, the covariance of its right perturbation, and the derivative of that
/// perturbation by the systematic errors.
struct CompoundMotion {
  Pose T_a_b;
  Matrix6d covariance = Matrix6d::Zero();
  Matrix64d by_systematic = Matrix64d::Zero();

  void append(const Pose& T_measured, const Matrix6d& step_covariance, const Vector4d& systematic);
};

/// The measured motions between consecutive keyframes, compactly (some 350 bytes each), for good: what folded keyframes
/// are unfolded from, and what the uncertainty between any two keyframes is read from without solving anything. Copies
/// share what does not change any more.
class OdometryChain {
 public:
  /// Adds keyframe `size()`, not measured against the one before it until link() says so.
  void add_keyframe();
  /// The motion from the keyframe before the newest one to the newest one.
  void link(const Pose& T_measured, const Matrix6d& covariance);

  std::size_t size() const { return links_.size(); }
  bool linked(std::size_t keyframe) const { return links_[keyframe].measured; }  ///< to the one before it
  const Pose& measured(std::size_t keyframe) const { return links_[keyframe].T_measured; }
  double path_m(std::size_t keyframe) const { return links_[keyframe].path_m; }  ///< measured, since keyframe 0

  /// The motions from a to b > a as one, systematic errors taken out; linear in their number. All must be linked.
  CompoundMotion compound(std::size_t a, std::size_t b, const Vector4d& systematic) const;
  /// Covariance of T_a_b (of its right perturbation) by odometry alone, a < b, at a cost that does not depend on their
  /// distance; nothing where a link between them is missing. One systematic error of this covariance along the way.
  std::optional<Matrix6d> covariance(std::size_t a, std::size_t b, const Matrix4d& systematic_covariance) const;

  /// Covariance of what odometry's errors between them do to keyframes a to b as a whole, a <= m <= b: of the right
  /// perturbation of m that follows their mean displacement and mean turn, seen from m. Whoever finds them all
  /// together on a map finds m by so much off. Linear in their number; nothing where a link is missing.
  std::optional<Matrix6d> bend(std::size_t a, std::size_t m, std::size_t b,
                               const Matrix4d& systematic_covariance) const;

  /// The motion itself at the same cost, to first order in the systematic errors.
  Pose motion(std::size_t a, std::size_t b, const Vector4d& systematic) const;

  /// Poses of the keyframes between a and b, given where those two are: the chain's own shape, its misfit at the end
  /// spread by its covariance. Element n is keyframe a + 1 + n.
  std::vector<Pose> between(std::size_t a, std::size_t b, const Pose& T_map_a, const Pose& T_map_b,
                            const Vector4d& systematic) const;
  /// How the perturbation of a keyframe k between a and b follows from theirs: by_a * xi_a + by_b * xi_b + remainder.
  struct Dependence {
    Matrix6d by_a, by_b, remainder;
  };
  Dependence dependence(std::size_t a, std::size_t k, std::size_t b, const Vector4d& systematic) const;

 private:
  using Packed = Eigen::Matrix<double, 21, 1>;  ///< lower triangle of a symmetric 6x6
  struct Link {
    Pose T_measured;
    Packed covariance = Packed::Zero();
    double path_m = 0.0;
    bool measured = false;
  };
  /// Sums from keyframe 0 to a keyframe, of dead reckoning: covariance and derivative of the left perturbation.
  struct Sums {
    Pose T_odometry;
    Matrix6d covariance = Matrix6d::Zero();
    Matrix64d by_systematic = Matrix64d::Zero();
    std::size_t gaps = 0;

    void append(const Link& link);
  };
  static Packed pack(const Matrix6d& matrix);
  static Matrix6d unpack(const Packed& packed);
  Sums sums_at(std::size_t keyframe) const;

  SharedHistory<Link> links_;
  SharedHistory<Sums> sums_;  ///< at every kStride-th keyframe
};

}  // namespace demslam

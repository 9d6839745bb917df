#pragma once

#include "demslam/base/archive.h"
#include "demslam/geometry/pose.h"

namespace demslam {

template <class Archive, class Scalar, int kRows, int kCols, int kOptions>
void archive(Archive& io, Eigen::Matrix<Scalar, kRows, kCols, kOptions>& matrix) {
  static_assert(kRows > 0 && kCols > 0, "of fixed size");
  for (Scalar& value : matrix.reshaped()) io(value);
}

inline void archive(ArchiveWriter& io, const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  const Eigen::Vector3d& p = pose.translation();
  io(q.w(), q.x(), q.y(), q.z(), p.x(), p.y(), p.z());
}

inline void archive(ArchiveReader& io, Pose& pose) {
  Eigen::Quaterniond q;
  Eigen::Vector3d p;
  io(q.w(), q.x(), q.y(), q.z(), p.x(), p.y(), p.z());
  pose = Pose::exactly(q, p);
}

}  // namespace demslam

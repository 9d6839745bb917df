#pragma once

#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include "demslam/graph/factor_table.h"

namespace demslam {

/// The part of `values` that belongs to `keys`.
gtsam::Values values_of(const gtsam::KeySet& keys, const gtsam::Values& values);

/// What the keyframes before end() say about the rest: their variables eliminated from a linearised graph, the result
/// kept as linear factors on what is left. Each keyframe is linearised once, where its estimate was when it left the
/// window.
class CondensedPast {
 public:
  void extend_to(std::size_t end, const FactorTable& table, const gtsam::Values& values);
  std::size_t end() const { return end_; }
  const gtsam::NonlinearFactorGraph& factors() const { return factors_; }

 private:
  std::size_t end_ = 0;
  gtsam::NonlinearFactorGraph factors_;
};

}  // namespace demslam

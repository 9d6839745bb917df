#pragma once

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <vector>

namespace demslam {

/// Keyframes are their own index; every other variable is a gtsam::Symbol.
inline bool is_keyframe(gtsam::Key key) { return gtsam::Symbol(key).chr() == 0; }

/// The part of `values` that belongs to `keys`.
gtsam::Values values_of(const gtsam::KeySet& keys, const gtsam::Values& values);

/// What the keyframes before end() say about the rest: their variables eliminated from a linearised graph, the result
/// kept as linear factors on what is left. Each keyframe is linearised once, where its estimate was when it left the
/// window.
class CondensedPast {
 public:
  using FactorsByKeyframe = std::vector<std::vector<gtsam::NonlinearFactor::shared_ptr>>;  ///< by their oldest keyframe

  void extend_to(std::size_t end, const FactorsByKeyframe& factors_from, const gtsam::Values& values);
  std::size_t end() const { return end_; }
  const gtsam::NonlinearFactorGraph& factors() const { return factors_; }

 private:
  std::size_t end_ = 0;
  gtsam::NonlinearFactorGraph factors_;
};

}  // namespace demslam

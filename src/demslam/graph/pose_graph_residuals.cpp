#include "demslam/graph/pose_graph_state.h"

namespace demslam {
namespace {

/// The error in standard deviations, without the kernel.
gtsam::Vector whitened(const gtsam::NoiseModelFactor& factor, const gtsam::Values& values) {
  const gtsam::Vector error = factor.unwhitenedError(values);
  const auto robust = boost::dynamic_pointer_cast<gtsam::noiseModel::Robust>(factor.noiseModel());
  return robust ? robust->noise()->whiten(error) : factor.noiseModel()->whiten(error);
}

}  // namespace

std::vector<FactorResidual> PoseGraph::residuals(const FactorKindOf& kind_of) const {
  const State& s = *state_;
  std::vector<FactorResidual> residuals;
  for (std::size_t keyframe = 0; keyframe < size(); ++keyframe) {
    for (const FactorTable::Factor& factor : s.factors.of(keyframe)) {
      const std::string kind = kind_of(*factor);
      const auto noisy = boost::dynamic_pointer_cast<gtsam::NoiseModelFactor>(factor);
      if (kind.empty() || !noisy || !factor->active(s.values)) continue;
      const gtsam::Vector error = whitened(*noisy, s.values);
      residuals.push_back({kind, keyframe, static_cast<std::size_t>(error.size()), error.squaredNorm()});
    }
  }
  return residuals;
}

}  // namespace demslam

#include <utility>

#include "demslam/graph/loop_closure.h"

namespace demslam {

LoopVerifier stereo_verifier(const RectifiedRig& rig, FeatureSource features, Matcher& matcher,
                             const MotionOptions& options) {
  return [&rig, features = std::move(features), &matcher, options](std::size_t i, std::size_t j, const Pose& guess) {
    const auto old_view = features(i), new_view = features(j);
    if (!old_view || !new_view) return Motion{.reason = "features no longer kept"};
    return estimate_motion(rig, *old_view, *new_view, matcher, options, &guess);
  };
}

}  // namespace demslam

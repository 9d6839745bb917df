#pragma once

#include <optional>
#include <string>

#include "demslam/odometry/direct_match.h"
#include "demslam/odometry/motion.h"

namespace demslam {

/// Why a motion is not to be trusted; empty when it is. Where the matches are right nearly all agree; a consensus of
/// few among many is an accident of the search.
std::string refusal(const Motion& motion, const MotionOptions& options);

int points_with_depth(const StereoFeatures& features);

/// A motion where matching the whole images found none: points are looked for by their descriptors near where a guess
/// puts them, then everywhere, then where turns put them that nobody foresaw, from the guess and from no turn at all.
/// With `by_patches` a consensus of less than half of the matches is believed if patches (direct_match.h) bear it out.
/// None if nothing can be trusted.
std::optional<Motion> search_motion(const RectifiedRig& rig, const StereoView& a, const StereoView& b,
                                    const Pose& guess_T_a_b, const MotionOptions& options, bool by_patches);

}  // namespace demslam

#pragma once

#include "demslam/features/features.h"
#include "demslam/features/open_model.h"

namespace demslam {

/// The extractor for an opened model. Throws Error when its contract is not an extractor's.
std::unique_ptr<Extractor> make_learned_extractor(OpenModel model, int max_features);

/// The matcher for an opened model: keeps matches that score above `min_score`. Throws Error when its contract is not a
/// matcher's.
std::unique_ptr<Matcher> make_learned_matcher(OpenModel model, double min_score);

}  // namespace demslam

#pragma once

#include <string_view>
#include <vector>

#include "demslam/features/xfeat.h"

namespace demslam {

/// An ONNX graph that comes with the program, trained by training/ on images of our own simulator (docs/models.md).
struct BuiltInModel {
  std::string_view name, contract, graph;
  double min_probability = kXFeatMinProbability;  ///< of a keypoint
};

/// "lunar", the extractor, and "lunar-matcher", the matcher of its features.
const std::vector<BuiltInModel>& built_in_models();

}  // namespace demslam

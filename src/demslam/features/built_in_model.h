#pragma once

#include <string_view>

namespace demslam {

/// The feature extractor that comes with the program: an ONNX graph of contract "xfeat", trained by training/ on images
/// of our own simulator (docs/models.md).
std::string_view lunar_graph();

}  // namespace demslam

#pragma once

#include <map>
#include <set>
#include <string>

#include "demslam/features/network_array.h"
#include "demslam/features/onnx_graph.h"

namespace demslam::nn {

/// Joins nodes that are cheaper together, without changing what the graph means: Conv and Relu; MatMul with constant
/// weights and Add (demslam.Linear); MatMul, Softmax, MatMul (demslam.Attention); the five nodes of GELU
/// (demslam.Gelu); pixel_unshuffle as PyTorch writes it (demslam.SpaceToDepth; where only convolutions read it, their
/// weights are put into the order in which pixels are quickest gathered). Convolutions that only convolutions read are
/// marked. Names in `kept` are the graph's outputs, which stay as they are.
void fuse(std::vector<OnnxNode>& nodes, std::map<std::string, Array>& constants, const std::set<std::string>& kept);

}  // namespace demslam::nn

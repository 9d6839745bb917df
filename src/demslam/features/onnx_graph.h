#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "demslam/features/model_info.h"

namespace demslam {

/// A constant of a graph. Halves and doubles have become floats, int32 and booleans integers.
struct OnnxConstant {
  enum class Kind { floats, integers, booleans, other };

  Kind kind = Kind::other;  ///< other: a type that is not read, for example strings
  std::vector<std::int64_t> shape;
  std::vector<float> floats;           ///< row-major
  std::vector<std::int64_t> integers;  ///< row-major; also for booleans
};

/// Monostate: a kind of attribute that is not read, for example a sub-graph.
using OnnxAttribute = std::variant<std::monostate, std::int64_t, float, std::string, OnnxConstant,
                                   std::vector<std::int64_t>, std::vector<float>>;

struct OnnxNode {
  std::string op, domain;                    ///< domain: "" for ONNX's own operators
  std::vector<std::string> inputs, outputs;  ///< names of values; "" where an optional one is left out
  std::map<std::string, OnnxAttribute> attributes;
};

/// An ONNX model as it stands in its file: nodes in an order in which they can run.
struct OnnxGraph {
  std::int64_t opset = 0;  ///< version of ONNX's own operators
  std::vector<OnnxNode> nodes;
  std::map<std::string, OnnxConstant> constants;
  std::vector<TensorInfo> inputs, outputs;  ///< constants are no inputs
};

/// Reads the protocol buffer of onnx.proto (IR version 3 and later); `name` is for messages. Throws Error when it is no
/// ONNX model, truncated, or contradicts itself; what is merely unknown (types, attributes) is kept as such.
OnnxGraph parse_onnx(std::string_view bytes, const std::string& name);

}  // namespace demslam

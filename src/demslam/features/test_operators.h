#pragma once

#include <functional>
#include <string>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/features/onnx_session.h"
#include "demslam/features/test_onnx.h"

// Graphs of a node or a few, to hold an executor of networks against another one.
namespace demslam::test {

using Graph = OnnxGraph;
using Shape = std::vector<std::int64_t>;
using Ints = std::vector<std::int64_t>;

inline Tensor random_tensor(const Shape& shape, Random& random) {
  Tensor tensor{.shape = shape};
  std::int64_t count = 1;
  for (const std::int64_t size : shape) count *= size;
  for (std::int64_t i = 0; i < count; ++i) tensor.floats.push_back(static_cast<float>(random.normal()));
  return tensor;
}

inline std::vector<float> random_floats(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<float>(random.normal()));
  return values;
}

/// A graph of a few nodes from inputs "x", "y", ... to "out".
struct Case {
  std::string name;
  std::vector<Shape> inputs;
  std::function<void(Graph&)> build;
  std::size_t result_rank = 0;
  bool integers = false;
  std::int64_t opset = 17;

  std::string bytes() const {
    Graph graph;
    for (std::size_t i = 0; i < inputs.size(); ++i) graph.input(input_name(i), Shape(inputs[i].size(), -1));
    build(graph);
    const Shape any(result_rank, -1);
    integers ? graph.integer_result("out", any) : graph.float_result("out", any);
    return graph.bytes(opset);
  }
  static std::string input_name(std::size_t i) { return std::string(1, static_cast<char>('x' + i)); }
  std::vector<std::string> input_names() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < inputs.size(); ++i) names.push_back(input_name(i));
    return names;
  }
  std::vector<Tensor> random_inputs() const {
    Random random(7);
    std::vector<Tensor> tensors;
    for (const Shape& shape : inputs) tensors.push_back(random_tensor(shape, random));
    return tensors;
  }
};

inline Case unary(const std::string& op, bool positive = false) {
  return {op,
          {{2, 3, 37}},
          [=](Graph& g) {
            if (positive) g.node("Mul", {"x", "x"}, {"squared"});
            g.node(op, {positive ? "squared" : "x"}, {"out"});
          },
          3};
}

inline Case binary(const std::string& op, const std::string& name, const Shape& a, const Shape& b,
                   bool positive = false) {
  return {op + name,
          {a, b},
          [=](Graph& g) {
            if (positive) g.node("Abs", {"x"}, {"absolute"});
            g.node(op, {positive ? "absolute" : "x", "y"}, {"out"});
          },
          std::max(a.size(), b.size())};
}

/// A boolean result, as numbers.
inline Case comparison(const std::string& op) {
  return {op,
          {{4, 5}, {5}},
          [=](Graph& g) {
            g.node("Floor", {"x"}, {"a"});
            g.node("Floor", {"y"}, {"b"});
            g.node(op, {"a", "b"}, {"which"});
            g.node("Cast", {"which"}, {"out"}, {Graph::integer("to", 1)});
          },
          2};
}

inline Case logic(const std::string& op) {
  return {op,
          {{4, 5}, {5}},
          [=](Graph& g) {
            g.constant("zero", {}, std::vector<float>{0.0F});
            g.node("Less", {"x", "zero"}, {"a"});
            g.node("Less", {"y", "zero"}, {"b"});
            g.node(op, op == "Not" ? std::vector<std::string>{"a"} : std::vector<std::string>{"a", "b"}, {"which"});
            g.node("Cast", {"which"}, {"out"}, {Graph::integer("to", 1)});
          },
          2};
}

inline Case convolution(const std::string& name, const Shape& weights, std::int64_t size, const Shape& pads,
                        const Shape& strides, std::int64_t groups = 1, const Shape& dilations = {1, 1}) {
  std::int64_t count = 1;
  for (const std::int64_t extent : weights) count *= extent;
  return {"Conv" + name,
          {{2, weights[1] * groups, size, size + 3}},
          [=](Graph& g) {
            g.constant("w", weights, random_floats(static_cast<std::size_t>(count), 3));
            g.constant("b", {weights[0]}, random_floats(static_cast<std::size_t>(weights[0]), 4));
            g.node("Conv", {"x", "w", "b"}, {"out"},
                   {Graph::integers("kernel_shape", {weights[2], weights[3]}), Graph::integers("pads", pads),
                    Graph::integers("strides", strides), Graph::integer("group", groups),
                    Graph::integers("dilations", dilations)});
          },
          4};
}

inline Case reduction(const std::string& op, const Ints& axes, std::int64_t keep) {
  return {op + std::to_string(axes.size()) + (keep ? "Kept" : "Gone") + std::to_string(axes[0]),
          {{2, 3, 40}},
          [=](Graph& g) {
            const bool as_input = op == "ReduceSum";  // since operator set 13
            if (as_input) g.constant("axes", {static_cast<std::int64_t>(axes.size())}, axes);
            std::vector<Graph::Attribute> attributes{Graph::integer("keepdims", keep)};
            if (!as_input) attributes.push_back(Graph::integers("axes", axes));
            g.node(op, as_input ? std::vector<std::string>{"x", "axes"} : std::vector<std::string>{"x"}, {"out"},
                   attributes);
          },
          keep ? 3 : 3 - axes.size()};
}

inline Case along(const std::string& op, std::int64_t axis) {
  return {op + std::to_string(axis),
          {{3, 33, 35}},
          [=](Graph& g) { g.node(op, {"x"}, {"out"}, {Graph::integer("axis", axis)}); },
          3};
}

inline Case arg_max(std::int64_t axis, std::int64_t keep) {
  return {"ArgMax" + std::to_string(axis) + (keep ? "Kept" : "Gone"),
          {{3, 33, 35}},
          [=](Graph& g) {
            g.node("Mul", {"x", "x"}, {"squared"});
            g.node("Ceil", {"squared"}, {"coarse"});  // equal ones: the first counts
            g.node("ArgMax", {"coarse"}, {"out"}, {Graph::integer("axis", axis), Graph::integer("keepdims", keep)});
          },
          keep ? 3U : 2U,
          true};
}

inline Case top_k(std::int64_t k, std::int64_t axis, bool indices) {
  return {"TopK" + std::to_string(k) + "Axis" + std::to_string(axis) + (indices ? "Indices" : "Values"),
          {{3, 20, 35}},
          [=](Graph& g) {
            g.constant("k", {1}, Ints{k});
            g.node("TopK", {"x", "k"}, {indices ? "values" : "out", indices ? "out" : "indices"},
                   {Graph::integer("axis", axis)});
          },
          3,
          indices};
}

inline Case slice(const std::string& name, const Ints& starts, const Ints& ends, const Ints& axes, const Ints& steps) {
  return {"Slice" + name,
          {{4, 6, 7}},
          [=](Graph& g) {
            const auto size = static_cast<std::int64_t>(starts.size());
            g.constant("starts", {size}, starts);
            g.constant("ends", {size}, ends);
            g.constant("axes", {size}, axes);
            g.constant("steps", {size}, steps);
            g.node("Slice", {"x", "starts", "ends", "axes", "steps"}, {"out"});
          },
          3};
}

inline Case resize(const std::string& name, const std::string& mode, bool sizes) {
  return {"Resize" + name,
          {{2, 3, 5, 7}},
          [=](Graph& g) {
            g.constant("scales", {4}, std::vector<float>{1.0F, 1.0F, 2.0F, 4.0F});
            g.constant("sizes", {4}, Ints{2, 3, 13, 9});
            const std::vector<std::string> by_scale{"x", "", "scales"}, by_size{"x", "", "", "sizes"};
            g.node("Resize", sizes ? by_size : by_scale, {"out"},
                   {Graph::text("mode", "linear"), Graph::text("coordinate_transformation_mode", mode)});
          },
          4};
}

inline Case pool(const std::string& op, const std::string& name, std::int64_t kernel, std::int64_t stride,
                 std::int64_t pad, std::int64_t include) {
  return {op + name,
          {{2, 3, 17, 20}},
          [=](Graph& g) {
            std::vector<Graph::Attribute> attributes{
                Graph::integers("kernel_shape", {kernel, kernel}), Graph::integers("strides", {stride, stride}),
                Graph::integers("pads", {pad, pad, pad, pad}), Graph::integer("ceil_mode", 0)};
            if (op == "AveragePool") attributes.push_back(Graph::integer("count_include_pad", include));
            g.node(op, {"x"}, {"out"}, attributes);
          },
          4};
}

}  // namespace demslam::test

#include "demslam/features/network.h"

#include <algorithm>
#include <set>

#include "demslam/base/error.h"
#include "demslam/features/network_fusion.h"
#include "demslam/features/network_operators.h"

namespace demslam {
namespace {

using nn::Array;
using nn::Arrays;

constexpr std::int64_t kOldestOpset = 13, kNewestOpset = 20;

/// A view of the tensor, which must live on; nothing writes to an input.
Array view_of(const Tensor& tensor) {
  nn::Dims strides = nn::row_major(tensor.shape);
  if (tensor.channels_alike) strides.at(1) = 0;
  const std::int64_t count = nn::count_of(tensor.shape) / (tensor.channels_alike ? tensor.shape[1] : 1);
  nn::expect(static_cast<std::int64_t>(tensor.floats.size()) == count, "an input that does not fill its shape");
  static std::byte nothing{};  // an array without values is there all the same
  auto* start =
      tensor.floats.empty() ? &nothing : reinterpret_cast<std::byte*>(const_cast<float*>(tensor.floats.data()));
  const std::shared_ptr<std::byte> borrowed(start, [](std::byte*) {});
  return {nn::Type::f32, tensor.shape, strides, borrowed, start};
}

Tensor to_tensor(nn::Pool& pool, const Array& a, bool as_it_lies) {
  Tensor tensor{.shape = a.shape};
  if (a.type == nn::Type::f32 || a.type == nn::Type::bf16) {
    tensor.channels_last = as_it_lies && a.rank() == 4 && a.strides == nn::channels_last(a.shape);
    const Array dense =
        tensor.channels_last ? nn::as_channels_last(pool, a, nn::Type::f32) : nn::as_row_major(pool, a, nn::Type::f32);
    tensor.floats.assign(dense.data<float>(), dense.data<float>() + dense.count());
  } else {
    tensor.integers = nn::integers_of(a);
  }
  return tensor;
}

std::string short_name(const OnnxNode& node) { return node.op + " '" + node.outputs.at(0) + "'"; }

}  // namespace

struct Network::Plan {
  Plan(std::string title, const Options& options) : name(std::move(title)), engine(options.threads, options.bf16) {}

  /// A node with its values by number; those that nothing reads later are let go after it.
  struct Ready {
    nn::Step step;
    std::vector<int> inputs, outputs, last_used;
    std::string label;
  };

  std::string name;
  nn::Engine engine;
  nn::Products products;
  std::vector<Ready> steps;
  std::map<std::string, int> numbers;
  Arrays constants;  ///< by number; empty where a value is made in the run

  int number(const std::string& value) {
    return numbers.try_emplace(value, static_cast<int>(numbers.size())).first->second;
  }
  void compile(const OnnxGraph& graph);
  std::vector<OnnxNode> fold(const OnnxGraph& graph, std::map<std::string, Array>& known);
  void let_go(const std::set<int>& kept);
  Arrays run(Arrays values);
};

/// Runs what depends on constants alone; gives the nodes that are left.
std::vector<OnnxNode> Network::Plan::fold(const OnnxGraph& graph, std::map<std::string, Array>& known) {
  std::vector<OnnxNode> left;
  for (const OnnxNode& node : graph.nodes) {
    const bool fixed = std::ranges::all_of(
        node.inputs, [&](const std::string& input) { return input.empty() || known.contains(input); });
    if (!fixed) {
      left.push_back(node);
      continue;
    }
    Arrays inputs;
    for (const std::string& input : node.inputs) inputs.push_back(input.empty() ? Array() : known.at(input));
    const Arrays results = nn::make_step(node, known, engine, products)(inputs);
    for (std::size_t i = 0; i < node.outputs.size(); ++i) known[node.outputs[i]] = results.at(i);
  }
  return left;
}

/// Notes after which step each value is needed no more.
void Network::Plan::let_go(const std::set<int>& kept) {
  std::set<int> needed = kept;
  for (std::size_t value = 0; value < constants.size(); ++value) {
    if (constants[value]) needed.insert(static_cast<int>(value));
  }
  for (auto ready = steps.rbegin(); ready != steps.rend(); ++ready) {
    for (const std::vector<int>* values : {&ready->inputs, &ready->outputs}) {
      for (const int value : *values) {
        if (value >= 0 && needed.insert(value).second) ready->last_used.push_back(value);
      }
    }
  }
}

void Network::Plan::compile(const OnnxGraph& graph) {
  if (graph.opset < kOldestOpset || graph.opset > kNewestOpset) {
    throw nn::Uncovered{"operator set " + std::to_string(graph.opset)};
  }
  std::map<std::string, Array> known;
  for (const auto& [title, constant] : graph.constants) {
    if (constant.kind == OnnxConstant::Kind::other) throw nn::Uncovered{"the type of constant '" + title + "'"};
    known[title] = nn::to_array(engine.pool(), constant);
  }
  std::vector<OnnxNode> nodes = fold(graph, known);
  std::set<std::string> outputs;
  for (const TensorInfo& output : graph.outputs) outputs.insert(output.name);
  nn::fuse(nodes, known, outputs);

  for (const TensorInfo& input : graph.inputs) {
    if (input.type != "float32") throw nn::Uncovered{"the type of input '" + input.name + "'"};
    number(input.name);
  }
  for (const OnnxNode& node : nodes) {
    Ready ready{.step = nn::make_step(node, known, engine, products), .label = short_name(node)};
    for (const std::string& input : node.inputs) ready.inputs.push_back(input.empty() ? -1 : number(input));
    for (const std::string& output : node.outputs) ready.outputs.push_back(output.empty() ? -1 : number(output));
    steps.push_back(std::move(ready));
  }
  std::set<int> kept;
  for (const std::string& output : outputs) kept.insert(number(output));
  constants.resize(numbers.size());
  for (const auto& [title, array] : known) {
    if (const auto used = numbers.find(title); used != numbers.end()) constants[used->second] = array;
  }
  let_go(kept);
}

Arrays Network::Plan::run(Arrays values) {
  for (const Ready& ready : steps) {
    Arrays inputs;
    for (const int value : ready.inputs) inputs.push_back(value < 0 ? Array() : values[value]);
    try {
      Arrays results = ready.step(inputs);
      nn::expect(results.size() >= ready.outputs.size(), "an operator that gives less than is asked for");
      for (std::size_t i = 0; i < ready.outputs.size(); ++i) {
        if (ready.outputs[i] >= 0) values[ready.outputs[i]] = std::move(results[i]);
      }
    } catch (const std::exception& error) {  // oneDNN's and the standard library's, too
      throw Error(name + ": the model failed while running (" + ready.label + ": " + error.what() + ")");
    }
    for (const int value : ready.last_used) values[value] = {};
  }
  return values;
}

std::unique_ptr<Network> Network::build(const OnnxGraph& graph, const std::string& name, const Options& options,
                                        std::string& why_not) {
  const nn::OneOpenMpThread one;
  auto plan = std::make_unique<Plan>(name, options);
  try {
    plan->compile(graph);
  } catch (const nn::Uncovered& uncovered) {
    why_not = uncovered.reason;
    return nullptr;
  } catch (const std::exception& error) {
    throw Error(name + ": not a usable ONNX model (" + error.what() + ")");
  }
  return std::unique_ptr<Network>(new Network(std::move(plan)));
}

Network::Network(std::unique_ptr<Plan> plan) : plan_(std::move(plan)) {}
Network::~Network() = default;

std::vector<Tensor> Network::run(const std::vector<std::string>& input_names, const std::vector<Tensor>& inputs,
                                 const std::vector<std::string>& output_names, bool as_they_lie) {
  const nn::OneOpenMpThread one;
  Arrays values = plan_->constants;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    values[plan_->numbers.at(input_names[i])] = view_of(inputs[i]);
  }
  values = plan_->run(std::move(values));
  std::vector<Tensor> results;
  results.reserve(output_names.size());
  for (const std::string& output : output_names) {
    results.push_back(to_tensor(plan_->engine.pool(), values[plan_->numbers.at(output)], as_they_lie));
  }
  return results;
}

}  // namespace demslam

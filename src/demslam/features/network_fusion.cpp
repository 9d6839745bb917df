#include "demslam/features/network_fusion.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace demslam::nn {
namespace {

using Constants = std::map<std::string, Array>;

/// Nodes with who makes and who reads each value. A node that has been joined to another has no operator any more.
class Net {
 public:
  Net(std::vector<OnnxNode>& all, Constants& known, const std::set<std::string>& kept)
      : nodes(all), constants(known), kept_(kept) {
    index();
  }

  std::vector<OnnxNode>& nodes;
  Constants& constants;

  bool is_constant(const std::string& name) const { return constants.contains(name); }
  std::optional<float> scalar(const std::string& name) const {
    const auto found = constants.find(name);
    if (found == constants.end() || found->second.count() != 1 || found->second.type != Type::f32) return std::nullopt;
    return *found->second.data<float>();
  }
  bool is_integers(const std::string& name, const Dims& wanted) const {
    const auto found = constants.find(name);
    return found != constants.end() && found->second.type == Type::i64 && integers_of(found->second) == wanted;
  }

  bool is_kept(const std::string& name) const { return kept_.contains(name); }
  const std::vector<OnnxNode*>& readers(const std::string& name) const {
    static const std::vector<OnnxNode*> kNone;
    const auto found = readers_.find(name);
    return found == readers_.end() ? kNone : found->second;
  }
  OnnxNode* source(const std::string& name) const {
    const auto found = makers_.find(name);
    return found == makers_.end() ? nullptr : found->second;
  }
  /// The node that makes a value which nothing but one node reads; null otherwise, or when it is not of that operator.
  OnnxNode* sole_source(const std::string& name, const std::string& op) const {
    const auto found = makers_.find(name);
    if (found == makers_.end() || found->second->op != op || !found->second->domain.empty()) return nullptr;
    return readers(name).size() == 1 && !is_kept(name) ? found->second : nullptr;
  }
  /// The only reader of a value, of that operator; null otherwise.
  OnnxNode* sole_reader(const OnnxNode& node, const std::string& op) const {
    if (node.outputs.size() != 1 || is_kept(node.outputs[0]) || readers(node.outputs[0]).size() != 1) return nullptr;
    OnnxNode* reader = readers(node.outputs[0]).front();
    return reader->op == op && reader->domain.empty() ? reader : nullptr;
  }

  /// Takes joined nodes out.
  void clean() {
    std::erase_if(nodes, [](const OnnxNode& node) { return node.op.empty(); });
    index();
  }

 private:
  void index() {
    makers_.clear();
    readers_.clear();
    for (OnnxNode& node : nodes) {
      for (const std::string& name : node.outputs) makers_[name] = &node;
      for (const std::string& name : node.inputs) readers_[name].push_back(&node);
    }
  }

  std::set<std::string> kept_;
  std::map<std::string, OnnxNode*> makers_;
  std::map<std::string, std::vector<OnnxNode*>> readers_;
};

void drop(OnnxNode& node) { node = OnnxNode(); }

void join_relus(Net& net) {
  for (OnnxNode& node : net.nodes) {
    if (node.op != "Conv") continue;
    OnnxNode* relu = net.sole_reader(node, "Relu");
    if (relu == nullptr) continue;
    node.attributes["demslam.relu"] = std::int64_t{1};
    node.outputs = relu->outputs;
    drop(*relu);
  }
  net.clean();
}

/// The other input of a node with two.
const std::string& other_input(const OnnxNode& node, const std::string& name) {
  return node.inputs[node.inputs[0] == name ? 1 : 0];
}

void join_linear_layers(Net& net) {
  for (OnnxNode& node : net.nodes) {
    if (node.op != "MatMul" || node.inputs.size() != 2 || !net.is_constant(node.inputs[1])) continue;
    const Array& weights = net.constants.at(node.inputs[1]);
    if (weights.rank() != 2) continue;
    node.domain = "demslam";
    node.op = "Linear";
    OnnxNode* add = net.sole_reader(node, "Add");
    if (add == nullptr) continue;
    const std::string bias = other_input(*add, node.outputs[0]);
    if (!net.is_constant(bias) || net.constants.at(bias).shape != Dims{weights.shape[1]}) continue;
    node.inputs.push_back(bias);
    node.outputs = add->outputs;
    drop(*add);
  }
  net.clean();
}

void join_attention(Net& net) {
  for (OnnxNode& node : net.nodes) {
    if (node.op != "MatMul" || node.inputs.size() != 2) continue;
    OnnxNode* softmax = net.sole_source(node.inputs[0], "Softmax");
    OnnxNode* scores = softmax == nullptr ? nullptr : net.sole_source(softmax->inputs[0], "MatMul");
    if (scores == nullptr) continue;
    node.domain = "demslam";
    node.op = "Attention";
    node.attributes = softmax->attributes;
    node.inputs = {scores->inputs[0], scores->inputs[1], node.inputs[1]};
    drop(*softmax);
    drop(*scores);
  }
  net.clean();
}

/// x / sqrt(2) -> Erf -> + 1 -> * x -> * 0.5
void join_gelus(Net& net) {
  const auto is = [&](const std::string& name, float value) {
    const auto scalar = net.scalar(name);
    return scalar && std::abs(*scalar - value) < 1e-6F;
  };
  for (OnnxNode& half : net.nodes) {
    if (half.op != "Mul" || !is(half.inputs.at(1), 0.5F)) continue;
    OnnxNode* product = net.sole_source(half.inputs[0], "Mul");
    OnnxNode* plus = product == nullptr ? nullptr : net.sole_source(product->inputs.at(1), "Add");
    OnnxNode* erf =
        plus == nullptr || !is(plus->inputs.at(1), 1.0F) ? nullptr : net.sole_source(plus->inputs[0], "Erf");
    OnnxNode* over = erf == nullptr ? nullptr : net.sole_source(erf->inputs.at(0), "Div");
    if (over == nullptr || !is(over->inputs.at(1), std::sqrt(2.0F)) || over->inputs[0] != product->inputs[0]) continue;
    half.domain = "demslam";
    half.op = "Gelu";
    half.inputs = {over->inputs[0]};
    for (OnnxNode* node : {product, plus, erf, over}) drop(*node);
  }
  net.clean();
}

/// [N,C,H,W] -> [N,C,H/b,b,W/b,b] -> [N,C,b,b,H/b,W/b] -> [N,C*b*b,H/b,W/b], as torch.onnx writes pixel_unshuffle.
void join_pixel_unshuffles(Net& net) {
  for (OnnxNode& last : net.nodes) {
    if (last.op != "Squeeze" || last.inputs.size() != 2 || !net.is_integers(last.inputs[1], {2, 3})) continue;
    OnnxNode* merge = net.sole_source(last.inputs[0], "Reshape");
    OnnxNode* turn = merge == nullptr ? nullptr : net.sole_source(merge->inputs[0], "Transpose");
    OnnxNode* columns = turn == nullptr ? nullptr : net.sole_source(turn->inputs[0], "Reshape");
    OnnxNode* rows = columns == nullptr ? nullptr : net.sole_source(columns->inputs[0], "Reshape");
    OnnxNode* first = rows == nullptr ? nullptr : net.sole_source(rows->inputs[0], "Unsqueeze");
    if (first == nullptr || first->inputs.size() != 2 || !net.is_integers(first->inputs[1], {3})) continue;
    const Dims* order = std::get_if<Dims>(&turn->attributes["perm"]);
    if (order == nullptr || *order != Dims{0, 1, 3, 5, 2, 4}) continue;
    if (!net.is_integers(merge->inputs.at(1), {0, -1, 1, 1, 0, 0}) || !net.is_constant(rows->inputs.at(1))) continue;
    const Dims split = integers_of(net.constants.at(rows->inputs[1]));
    if (split.size() != 5 || split != Dims{0, 0, -1, split[3], 0} ||
        !net.is_integers(columns->inputs.at(1), {0, 0, 0, 0, -1, split[3]})) {
      continue;
    }
    last.domain = "demslam";
    last.op = "SpaceToDepth";
    last.inputs = {first->inputs[0]};
    last.attributes = {{"blocksize", split[3]}, {"channel_first", std::int64_t{1}}};
    for (OnnxNode* node : {merge, turn, columns, rows, first}) drop(*node);
  }
  net.clean();
}

/// Channels of an image that convolutions made; none where that is not told.
std::optional<std::int64_t> channels_of(const Net& net, const std::string& name) {
  const OnnxNode* node = net.source(name);
  if (node == nullptr) return std::nullopt;
  if (node->op == "Conv" && net.is_constant(node->inputs[1])) return net.constants.at(node->inputs[1]).shape.at(0);
  if (node->op != "SpaceToDepth") return std::nullopt;
  const auto before = channels_of(net, node->inputs[0]);
  const std::int64_t* block = std::get_if<std::int64_t>(&node->attributes.at("blocksize"));
  return before && block ? std::optional(*before * *block * *block) : std::nullopt;
}

/// Where an input of a concatenation begins in its result.
std::optional<std::int64_t> place_in(const Net& net, const OnnxNode& concat, const std::string& part) {
  std::int64_t place = 0;
  for (const std::string& input : concat.inputs) {
    if (input == part) return place;
    const auto channels = channels_of(net, input);
    if (!channels) return std::nullopt;
    place += *channels;
  }
  return std::nullopt;
}

/// The weights for input channels [first, first + channels * cells) in the order cell, channel instead of channel,
/// cell.
Array with_cells_first(const Array& weights, std::int64_t first, std::int64_t channels, std::int64_t cells) {
  Pool pool;
  const Array old = as_row_major(pool, weights, Type::f32);
  Array fresh = make_array(pool, Type::f32, old.shape);
  copy(old, fresh);
  const std::int64_t size = old.strides[1];
  for (std::int64_t o = 0; o < old.shape[0]; ++o) {
    for (std::int64_t i = 0; i < channels * cells; ++i) {
      const std::int64_t to = i % cells * channels + i / cells;
      const float* from = old.data<float>() + o * old.strides[0] + (first + i) * size;
      std::copy_n(from, size, fresh.data<float>() + o * old.strides[0] + (first + to) * size);
    }
  }
  return fresh;
}

bool joins_channels(const OnnxNode& node) {
  const auto axis = node.attributes.find("axis");
  const std::int64_t* value = axis == node.attributes.end() ? nullptr : std::get_if<std::int64_t>(&axis->second);
  return node.op == "Concat" && value != nullptr && *value == 1;
}

/// Gathers pixels cell by cell, whose channels lie side by side, where the weights of the one convolution that reads
/// them can be put into that order, too.
void reorder_space_to_depth(Net& net) {
  for (OnnxNode& node : net.nodes) {
    if (node.op != "SpaceToDepth" || !node.attributes.contains("channel_first")) continue;
    const std::string& result = node.outputs[0];
    if (net.is_kept(result) || net.readers(result).size() != 1) continue;
    OnnxNode* reader = net.readers(result).front();
    std::optional<std::int64_t> place = 0;
    if (joins_channels(*reader)) {
      place = place_in(net, *reader, result);
      reader = net.sole_reader(*reader, "Conv");
    }
    const auto channels = channels_of(net, node.inputs[0]);
    const bool fits = reader != nullptr && reader->op == "Conv" && net.is_constant(reader->inputs.at(1)) && place &&
                      channels && net.readers(reader->inputs[1]).size() == 1;
    const std::int64_t block = std::get<std::int64_t>(node.attributes.at("blocksize"));
    if (!fits || net.constants.at(reader->inputs[1]).shape.at(1) < *place + *channels * block * block) continue;
    Array& weights = net.constants.at(reader->inputs[1]);
    weights = with_cells_first(weights, *place, *channels, block * block);
    node.attributes.erase("channel_first");
  }
}

/// Does everything that reads the value, through what keeps its precision, end in convolutions?
bool ends_in_convolutions(const Net& net, const std::string& name) {
  static const std::set<std::string> kThrough{"Add",      "Concat", "Relu",   "Resize", "MaxPool",     "AveragePool",
                                              "Identity", "Slice",  "Concat", "Split",  "SpaceToDepth"};
  if (net.is_kept(name)) return false;
  for (const OnnxNode* reader : net.readers(name)) {
    if (reader->op == "Conv" && reader->inputs[0] == name) continue;
    if (!kThrough.contains(reader->op)) return false;
    for (const std::string& output : reader->outputs) {
      if (!ends_in_convolutions(net, output)) return false;
    }
  }
  return !net.readers(name).empty();
}

void mark_convolutions(Net& net) {
  for (OnnxNode& node : net.nodes) {
    if (node.op == "Conv" && ends_in_convolutions(net, node.outputs[0])) {
      node.attributes["demslam.for_convolutions"] = std::int64_t{1};
    }
  }
}

}  // namespace

void fuse(std::vector<OnnxNode>& nodes, Constants& constants, const std::set<std::string>& kept) {
  Net net(nodes, constants, kept);
  join_relus(net);
  join_linear_layers(net);
  join_attention(net);
  join_gelus(net);
  join_pixel_unshuffles(net);
  reorder_space_to_depth(net);
  mark_convolutions(net);
}

}  // namespace demslam::nn

#include "demslam/features/inference.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "demslam/base/error.h"
#include "demslam/features/frontend_names.h"
#include "demslam/features/network.h"
#include "demslam/features/network_engine.h"

namespace demslam {
namespace {

const std::string kAuto = "auto", kOnnxRuntime = "onnxruntime", kOneDnn = "onednn";

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Writes every channel out.
void spread_channels(Tensor& tensor) {
  if (!tensor.channels_alike) return;
  const std::vector<float> one = std::move(tensor.floats);
  tensor.floats.clear();
  tensor.floats.reserve(one.size() * static_cast<std::size_t>(tensor.shape[1]));
  for (std::int64_t c = 0; c < tensor.shape[1]; ++c) {
    tensor.floats.insert(tensor.floats.end(), one.begin(), one.end());
  }
  tensor.channels_alike = false;
}

}  // namespace

std::vector<std::string> inference_names() { return {kAuto, kOnnxRuntime, kOneDnn}; }

std::string resolved_inference(const std::string& name) {
  const std::vector<std::string> known = inference_names();
  if (std::ranges::find(known, name) == known.end()) {
    throw Error("unknown inference '" + name + "'; known: auto, onnxruntime, onednn");
  }
  if (name != kAuto) return name;
  return nn::has_native_bf16() ? kOneDnn : kOnnxRuntime;
}

Inference::Inference(const std::filesystem::path& file, const InferenceOptions& options) {
  if (resolved_inference(options.backend) == kOneDnn && std::filesystem::is_regular_file(file)) {
    open_network(read_file(file), file.string(), options);
  }
  if (!network_) take(OnnxSession(file, options.threads), options);
}

Inference::Inference(std::string_view graph, const std::string& name, const InferenceOptions& options) {
  if (resolved_inference(options.backend) == kOneDnn) open_network(graph, name, options);
  if (!network_) take(OnnxSession(graph, name, options.threads), options);
}

Inference::~Inference() = default;
Inference::Inference(Inference&&) noexcept = default;

void Inference::open_network(std::string_view bytes, const std::string& name, const InferenceOptions& options) {
  try {
    OnnxGraph graph = parse_onnx(bytes, name);
    const bool bf16 = nn::has_native_bf16();
    network_ = Network::build(graph, name, {options.threads, bf16}, fallback_);
    backend_ = kOneDnn + (bf16 ? " bf16 " : " fp32 ") + nn::instruction_set();
    inputs_ = std::move(graph.inputs);
    outputs_ = std::move(graph.outputs);
  } catch (const Error& error) {  // ONNX Runtime may do better, and else says what is wrong
    fallback_ = error.what();
  }
}

void Inference::take(OnnxSession session, const InferenceOptions& options) {
  backend_ = kOnnxRuntime;
  if (options.backend == kAuto && !nn::has_native_bf16()) fallback_ = "this processor has no native bfloat16";
  inputs_ = session.inputs();
  outputs_ = session.outputs();
  session_ = std::make_unique<OnnxSession>(std::move(session));
}

std::vector<Tensor> Inference::run(const std::vector<std::string>& input_names, std::vector<Tensor> inputs,
                                   const std::vector<std::string>& output_names, bool as_they_lie) {
  if (network_) return network_->run(input_names, inputs, output_names, as_they_lie);
  for (Tensor& input : inputs) spread_channels(input);
  return session_->run(input_names, std::move(inputs), output_names);
}

}  // namespace demslam

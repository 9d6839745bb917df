#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "demslam/features/onnx_session.h"

namespace demslam {

class Network;

/// Who runs a graph: "onnxruntime" (in float); "onednn", which is demslam's own Network (in bfloat16 where the
/// processor multiplies that natively, else in float) for the graphs it covers and ONNX Runtime for the others; or
/// "auto": "onednn" on processors with native bfloat16, else "onnxruntime".
struct InferenceOptions {
  std::string backend = "auto";
  int threads = 2;
};

/// `name`, or what "auto" stands for on this processor. Throws Error when it is unknown.
std::string resolved_inference(const std::string& name);

/// An ONNX graph ready to run, whoever runs it. Deterministic on one processor, whatever the number of threads.
class Inference {
 public:
  /// Throws Error when the file is missing or no ONNX model.
  Inference(const std::filesystem::path& file, const InferenceOptions& options);
  /// From a graph in memory; `name` is for messages.
  Inference(std::string_view graph, const std::string& name, const InferenceOptions& options);
  ~Inference();
  Inference(Inference&&) noexcept;

  const std::vector<TensorInfo>& inputs() const { return inputs_; }
  const std::vector<TensorInfo>& outputs() const { return outputs_; }
  /// What the bits of a result depend on: "onnxruntime", or "onednn bf16 amx" and the like.
  const std::string& backend() const { return backend_; }
  /// Why ONNX Runtime runs a graph although it was not asked for; empty otherwise.
  const std::string& fallback() const { return fallback_; }

  /// Float inputs and the named outputs, in the order given; images may come with their channels last when
  /// `as_they_lie`. Throws Error when the graph fails.
  std::vector<Tensor> run(const std::vector<std::string>& input_names, std::vector<Tensor> inputs,
                          const std::vector<std::string>& output_names, bool as_they_lie = false);

 private:
  void open_network(std::string_view graph, const std::string& name, const InferenceOptions& options);
  void take(OnnxSession session, const InferenceOptions& options);

  std::vector<TensorInfo> inputs_, outputs_;
  std::string backend_, fallback_;
  std::unique_ptr<Network> network_;
  std::unique_ptr<OnnxSession> session_;
};

}  // namespace demslam

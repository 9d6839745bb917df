#pragma once

#include <memory>
#include <string_view>

#include "demslam/features/model_info.h"

namespace demslam {

/// A dense tensor, row-major; values are in `floats` or, for int64 outputs, in `integers`.
struct Tensor {
  std::vector<std::int64_t> shape;
  std::vector<float> floats;
  std::vector<std::int64_t> integers;
  bool channels_last = false;   ///< of shape [N,C,H,W], but in the order [N,H,W,C]
  bool channels_alike = false;  ///< of shape [1,C,H,W], but the values of one channel stand for all
};

/// An ONNX graph ready to run. Deterministic; its worker threads sleep between runs.
class OnnxSession {
 public:
  /// Throws Error when the file is missing or no ONNX model.
  OnnxSession(const std::filesystem::path& file, int threads);
  /// From a graph in memory; `name` is for messages. Throws Error when it is no ONNX model.
  OnnxSession(std::string_view graph, const std::string& name, int threads);
  ~OnnxSession();
  OnnxSession(OnnxSession&&) noexcept;

  std::vector<TensorInfo> inputs() const;
  std::vector<TensorInfo> outputs() const;

  /// Float inputs and the named outputs, in the order given. Throws Error when the graph fails.
  std::vector<Tensor> run(const std::vector<std::string>& input_names, std::vector<Tensor> inputs,
                          const std::vector<std::string>& output_names);

 private:
  struct Runtime;
  std::unique_ptr<Runtime> runtime_;
};

}  // namespace demslam

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/features/onnx_graph.h"
#include "demslam/features/onnx_session.h"

namespace demslam {

/// An ONNX graph run by demslam itself, its convolutions and matrix products by oneDNN (docs/models.md). The number of
/// threads changes nothing in a result; the processor may.
class Network {
 public:
  struct Options {
    int threads = 1;
    bool bf16 = true;  ///< factors of products in bfloat16, sums in float; else all in float
  };

  /// Null when the graph holds something that is not covered; `why_not` then says what. `name` is for messages. Throws
  /// Error when the graph contradicts itself.
  static std::unique_ptr<Network> build(const OnnxGraph& graph, const std::string& name, const Options& options,
                                        std::string& why_not);
  ~Network();

  /// As OnnxSession::run. `as_they_lie`: images may be given with their channels last.
  std::vector<Tensor> run(const std::vector<std::string>& input_names, const std::vector<Tensor>& inputs,
                          const std::vector<std::string>& output_names, bool as_they_lie = false);

 private:
  struct Plan;
  explicit Network(std::unique_ptr<Plan> plan);
  std::unique_ptr<Plan> plan_;
};

}  // namespace demslam

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "demslam/features/xfeat.h"

namespace demslam {

/// One input or output of a graph.
struct TensorInfo {
  std::string name, type;           ///< "float32", "int64" or "other"
  std::vector<std::int64_t> shape;  ///< -1: any size
};

/// What a model file takes and gives, and how it is to be fed (docs/models.md).
enum class Contract { xfeat, superpoint, lightglue };
std::string to_string(Contract contract);

/// The card <file>.toml beside a model; every field is optional.
struct ModelCard {
  std::string name, contract, licence, sha256, normalisation;
  double min_probability = kXFeatMinProbability;  ///< of a keypoint, contract xfeat
};

struct ModelInfo {
  std::filesystem::path file;
  ModelCard card;
  std::string sha256;  ///< of the file itself
  Contract contract = Contract::xfeat;
  int descriptor_width = -1;  ///< -1: the graph does not say
  std::vector<TensorInfo> inputs, outputs;
  std::string backend;   ///< who runs it here, "onnxruntime" or "onednn bf16 amx" and the like
  std::string fallback;  ///< why ONNX Runtime does although it was not asked for; else empty
};

/// Opens a model and says what it is. Throws Error with the reason: missing, not ONNX, truncated, a SHA-256 or contract
/// other than its card's, inputs and outputs that fit no contract.
ModelInfo inspect_model(const std::filesystem::path& file);

/// Those that come with the program: "lunar", "lunar-matcher".
std::vector<std::string> built_in_model_names();
/// One of them; `file` is a name to show. Throws Error when there is no such model.
ModelInfo inspect_built_in_model(const std::string& name);

}  // namespace demslam

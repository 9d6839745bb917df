#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "demslam/features/features.h"

namespace demslam {

/// Which extractor and matcher, and with what.
struct FrontendOptions {
  std::string extractor = "classical";    ///< "classical", "lunar", "onnx", "orb" or "sift" (docs/models.md)
  std::string matcher = "nearest";        ///< "nearest" (mutual, with ratio), "lunar" (for extractor "lunar") or "onnx"
  std::filesystem::path extractor_model;  ///< ONNX graph; its card is <file>.toml when there is one
  std::filesystem::path matcher_model;
  int max_features = 1500;         ///< per image
  double nearest_ratio = 0.9;      ///< Lowe's ratio for "nearest"
  double min_match_score = 0.1;    ///< for learned matchers
  int threads = 2;                 ///< for inference
  std::string inference = "auto";  ///< who runs the networks: "auto", "onnxruntime" or "onednn" (InferenceOptions)
};

struct Frontend {
  std::unique_ptr<Extractor> extractor;
  std::unique_ptr<Matcher> matcher;
  std::string inference;  ///< who runs its networks (ModelInfo::backend), extractor first; empty without any
};

/// Throws Error with the reason: unknown name, missing file, a model whose inputs and outputs fit no contract, SHA-256
/// mismatch.
Frontend make_frontend(const FrontendOptions& options);

/// The options with what "auto" stands for on this processor where a network is to be run, so that a record of them can
/// be repeated; without a network as they are.
FrontendOptions resolved(FrontendOptions options);

}  // namespace demslam

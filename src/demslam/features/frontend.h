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
  int max_features = 1500;       ///< per image
  double nearest_ratio = 0.9;    ///< Lowe's ratio for "nearest"
  double min_match_score = 0.1;  ///< for learned matchers
  int threads = 2;               ///< for inference
};

struct Frontend {
  std::unique_ptr<Extractor> extractor;
  std::unique_ptr<Matcher> matcher;
};

/// Throws Error with the reason: unknown name, missing file, a model whose inputs and outputs fit no contract, SHA-256
/// mismatch.
Frontend make_frontend(const FrontendOptions& options);

}  // namespace demslam

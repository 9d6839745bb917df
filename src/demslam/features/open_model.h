#pragma once

#include "demslam/features/inference.h"
#include "demslam/features/model_info.h"

namespace demslam {

/// A model whose contract is known, ready to run.
struct OpenModel {
  ModelInfo info;
  Inference session;
};

/// As inspect_model, keeping the session.
OpenModel open_model(const std::filesystem::path& file, const InferenceOptions& options);

/// One that comes with the program. Throws Error when there is no such model.
OpenModel open_built_in_model(const std::string& name, const InferenceOptions& options);

}  // namespace demslam

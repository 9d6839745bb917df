#include "demslam/features/model_info.h"

#include <algorithm>
#include <optional>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/features/built_in_model.h"
#include "demslam/features/open_model.h"
#include "demslam/toml/toml.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

std::string to_text(const TensorInfo& tensor) {
  std::string text = tensor.name + " " + tensor.type + "[";
  for (std::size_t i = 0; i < tensor.shape.size(); ++i) {
    text += (i ? "," : "") + (tensor.shape[i] < 0 ? std::string("?") : std::to_string(tensor.shape[i]));
  }
  return text + "]";
}

std::string to_text(const std::vector<TensorInfo>& tensors) {
  std::string text;
  for (const TensorInfo& tensor : tensors) text += (text.empty() ? "" : ", ") + to_text(tensor);
  return text;
}

/// The tensor of that name, type and shape (-1: any size), if it is there; a size the graph leaves open fits every
/// size.
std::optional<TensorInfo> find(const std::vector<TensorInfo>& tensors, const TensorInfo& wanted) {
  for (const TensorInfo& tensor : tensors) {
    const auto fits = [](std::int64_t have, std::int64_t want) { return have < 0 || want < 0 || have == want; };
    if (tensor.name == wanted.name && tensor.type == wanted.type &&
        std::ranges::equal(tensor.shape, wanted.shape, fits)) {
      return tensor;
    }
  }
  return std::nullopt;
}

bool is_image_input(const std::vector<TensorInfo>& inputs, std::int64_t channels) {
  return inputs.size() == 1 && find(inputs, {inputs[0].name, "float32", {-1, channels, -1, -1}});
}

bool is_xfeat(ModelInfo& info) {
  const auto descriptors = find(info.outputs, {"descriptors", "float32", {-1, -1, -1, -1}});
  if (!is_image_input(info.inputs, 3) || !descriptors ||
      !find(info.outputs, {"keypoint_logits", "float32", {-1, 65, -1, -1}}) ||
      !find(info.outputs, {"reliability", "float32", {-1, 1, -1, -1}})) {
    return false;
  }
  info.contract = Contract::xfeat;
  info.descriptor_width = static_cast<int>(descriptors->shape[1]);
  return true;
}

bool is_superpoint(ModelInfo& info) {
  const auto descriptors = find(info.outputs, {"descriptors", "float32", {-1, -1, -1}});
  if (!is_image_input(info.inputs, 1) || !descriptors || !find(info.outputs, {"keypoints", "int64", {-1, -1, 2}}) ||
      !find(info.outputs, {"scores", "float32", {-1, -1}})) {
    return false;
  }
  info.contract = Contract::superpoint;
  info.descriptor_width = static_cast<int>(descriptors->shape[2]);
  return true;
}

bool is_lightglue(ModelInfo& info) {
  const auto desc0 = find(info.inputs, {"desc0", "float32", {-1, -1, -1}}),
             desc1 = find(info.inputs, {"desc1", "float32", {-1, -1, -1}});
  const bool inputs =
      find(info.inputs, {"kpts0", "float32", {-1, -1, 2}}) && find(info.inputs, {"kpts1", "float32", {-1, -1, 2}});
  const auto output = [&](const std::string& indices, const std::string& scores) {
    return find(info.outputs, {indices, "int64", {-1, 2}}) && find(info.outputs, {scores, "float32", {-1}});
  };
  if (!desc0 || !desc1 || !inputs || !(output("matches", "scores") || output("matches0", "mscores0"))) return false;
  info.contract = Contract::lightglue;
  info.descriptor_width = static_cast<int>(desc0->shape[2]);
  return true;
}

bool is_fused_pipeline(const ModelInfo& info) {
  return is_image_input(info.inputs, -1) && find(info.outputs, {"matches", "int64", {-1, 3}});
}

void recognise(ModelInfo& info) {
  if (is_xfeat(info) || is_superpoint(info) || is_lightglue(info)) return;
  if (is_fused_pipeline(info)) {
    throw Error(info.file.string() +
                ": a fused pipeline (images in, matches out) cannot match frames it has not seen together; " +
                "use the separate extractor and matcher files (docs/models.md)");
  }
  throw Error(info.file.string() + ": fits no known contract (xfeat, superpoint, lightglue; docs/models.md): " +
              to_text(info.inputs) + " -> " + to_text(info.outputs));
}

ModelCard read_card(const fs::path& file) {
  ModelCard card;
  const fs::path path = file.string() + ".toml";
  if (!fs::exists(path)) return card;
  TomlReader reader = TomlReader::from_file(path);
  reader.field("name", card.name);
  reader.field("contract", card.contract);
  reader.field("licence", card.licence);
  reader.field("sha256", card.sha256);
  reader.field("normalisation", card.normalisation);
  reader.field("min_probability", card.min_probability);
  reader.reject_unknown();
  return card;
}

void check_hash(const ModelInfo& info) {
  if (info.card.sha256.empty() || info.card.sha256 == info.sha256) return;
  throw Error(info.file.string() + ": SHA-256 is " + info.sha256 + ", its card says " + info.card.sha256 +
              "; fetch the file again or correct the card");
}

std::string normalisation_of(Contract contract) { return contract == Contract::lightglue ? "centred" : "unit"; }

void check_card(const ModelInfo& info) {
  const std::string contract = to_string(info.contract), normalisation = normalisation_of(info.contract);
  if (!info.card.contract.empty() && info.card.contract != contract) {
    throw Error(info.file.string() + ": is a model of contract " + contract + ", its card says " + info.card.contract);
  }
  if (!info.card.normalisation.empty() && info.card.normalisation != normalisation) {
    throw Error(info.file.string() + ": a model of contract " + contract + " is fed with normalisation '" +
                normalisation + "', its card asks for '" + info.card.normalisation + "'");
  }
  if (info.card.min_probability < 0.0 || info.card.min_probability >= 1.0) {
    throw Error(info.file.string() + ": its card has a min_probability of " +
                std::to_string(info.card.min_probability) + "; it must be at least 0 and less than 1");
  }
}

/// Completes what is known of a model by what its graph says.
OpenModel identified(ModelInfo info, Inference session) {
  info.inputs = session.inputs();
  info.outputs = session.outputs();
  info.backend = session.backend();
  info.fallback = session.fallback();
  recognise(info);
  check_card(info);
  return {std::move(info), std::move(session)};
}

const BuiltInModel& built_in_model(const std::string& name) {
  const auto found = std::ranges::find(built_in_models(), name, &BuiltInModel::name);
  if (found == built_in_models().end()) throw Error("no model '" + name + "' is built in");
  return *found;
}

}  // namespace

std::string to_string(Contract contract) {
  switch (contract) {
    case Contract::xfeat:
      return "xfeat";
    case Contract::superpoint:
      return "superpoint";
    case Contract::lightglue:
      return "lightglue";
  }
  return "unknown";
}

OpenModel open_model(const fs::path& file, const InferenceOptions& options) {
  if (!fs::is_regular_file(file)) throw Error(file.string() + ": no such model file");
  ModelInfo info{.file = file, .card = read_card(file), .sha256 = sha256_of_file(file)};
  check_hash(info);
  return identified(std::move(info), Inference(file, options));
}

OpenModel open_built_in_model(const std::string& name, const InferenceOptions& options) {
  const BuiltInModel& model = built_in_model(name);
  ModelInfo info{.file = name + " (built in)",
                 .card = {.name = "demslam " + name,
                          .contract = std::string(model.contract),
                          .licence = "Apache-2.0, as demslam",
                          .min_probability = model.min_probability},
                 .sha256 = sha256_of(std::string(model.graph))};
  Inference session(model.graph, info.file.string(), options);
  return identified(std::move(info), std::move(session));
}

ModelInfo inspect_model(const fs::path& file) { return open_model(file, {.threads = 1}).info; }

std::vector<std::string> built_in_model_names() {
  std::vector<std::string> names;
  for (const BuiltInModel& model : built_in_models()) names.emplace_back(model.name);
  return names;
}

ModelInfo inspect_built_in_model(const std::string& name) { return open_built_in_model(name, {.threads = 1}).info; }

}  // namespace demslam

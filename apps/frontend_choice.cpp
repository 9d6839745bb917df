#include "frontend_choice.h"

#include "experiments.h"

namespace demslam::apps {
namespace {

namespace fs = std::filesystem;

/// "EXTRACTOR" or "EXTRACTOR,MATCHER".
ModelFiles model_files(const std::string& text) {
  const std::size_t comma = text.find(',');
  const fs::path extractor = text.substr(0, comma);
  return {.name = extractor.stem(),
          .extractor = extractor,
          .matcher = comma == std::string::npos ? "" : text.substr(comma + 1)};
}

}  // namespace

void FrontendChoice::add_options(CLI::App& command) {
  command.add_option("--points", points_, "keypoints per image, at most")->check(CLI::PositiveNumber);
  command.add_option("--xfeat", xfeat_, "XFeat's ONNX file, for its rows")->check(CLI::ExistingFile);
  command.add_option("--lighterglue", lighterglue_, "LighterGlue's ONNX file, for its row")->check(CLI::ExistingFile);
  command.add_option("--model", models_,
                     "ONNX file of another extractor, or \"EXTRACTOR,MATCHER\": rows named after the file");
  command.add_option("--front-end", names_, "these front-ends only, by name");
}

std::vector<NamedFrontend> FrontendChoice::frontends() const {
  std::vector<ModelFiles> models;
  if (has_xfeat()) models.push_back({"XFeat", xfeat_, lighterglue_, "LighterGlue"});
  for (const std::string& text : models_) models.push_back(model_files(text));
  std::vector<NamedFrontend> all = compared_frontends(points_, models);
  keep(all, names_, "front-end");
  return all;
}

}  // namespace demslam::apps

#include "demslam/features/frontend.h"

#include "demslam/base/error.h"
#include "demslam/features/classical_extractor.h"
#include "demslam/features/extractor_names.h"
#include "demslam/features/learned.h"
#include "demslam/features/nearest_matcher.h"
#include "demslam/features/opencv_extractor.h"

namespace demslam {
namespace {

constexpr int kAnyWidth = -1;

/// A part and the width of the descriptors it gives or takes.
template <class Part>
struct Sized {
  std::unique_ptr<Part> part;
  int descriptor_width = kAnyWidth;
};

Sized<Extractor> learned(OpenModel model, int max_features) {
  const int width = model.info.descriptor_width;
  return {make_learned_extractor(std::move(model), max_features), width};
}

using MakeExtractor = Sized<Extractor> (*)(const FrontendOptions&);

const std::vector<std::pair<std::string, MakeExtractor>>& extractors() {
  using O = FrontendOptions;
  static const std::vector<std::pair<std::string, MakeExtractor>> all{
      {"classical",
       [](const O& o) {
         return Sized<Extractor>{std::make_unique<ClassicalExtractor>(o.max_features),
                                 ClassicalExtractor::kDescriptorWidth};
       }},
      {"lunar", [](const O& o) { return learned(open_built_in_model("lunar", o.threads), o.max_features); }},
      {"onnx", [](const O& o) { return learned(open_model(o.extractor_model, o.threads), o.max_features); }},
      {"orb", [](const O& o) { return Sized<Extractor>{make_orb_extractor(o.max_features)}; }},
      {"sift", [](const O& o) { return Sized<Extractor>{make_sift_extractor(o.max_features)}; }},
  };
  return all;
}

Sized<Extractor> make_extractor(const FrontendOptions& options) {
  std::string known;
  for (const auto& [name, make] : extractors()) {
    if (name == options.extractor) return make(options);
    known += (known.empty() ? "" : ", ") + name;
  }
  throw Error("unknown extractor '" + options.extractor + "'; known: " + known);
}

Sized<Matcher> make_matcher(const FrontendOptions& options) {
  if (options.matcher == "nearest") return {std::make_unique<NearestMatcher>(options.nearest_ratio)};
  if (options.matcher != "lunar" && options.matcher != "onnx")
    throw Error("unknown matcher '" + options.matcher + "'; known: nearest, lunar, onnx");
  OpenModel model = options.matcher == "lunar" ? open_built_in_model("lunar-matcher", options.threads)
                                               : open_model(options.matcher_model, options.threads);
  const int width = model.info.descriptor_width;
  return {make_learned_matcher(std::move(model), options.min_match_score), width};
}

}  // namespace

std::vector<std::string> extractor_names() {
  std::vector<std::string> names;
  for (const auto& [name, make] : extractors()) names.push_back(name);
  return names;
}

Frontend make_frontend(const FrontendOptions& options) {
  Sized<Extractor> extractor = make_extractor(options);
  Sized<Matcher> matcher = make_matcher(options);
  const bool known = extractor.descriptor_width != kAnyWidth && matcher.descriptor_width != kAnyWidth;
  if (known && extractor.descriptor_width != matcher.descriptor_width) {
    const std::string name = options.matcher == "onnx" ? options.matcher_model.string() : options.matcher;
    throw Error(name + ": matches descriptors of width " + std::to_string(matcher.descriptor_width) +
                ", but the extractor gives width " + std::to_string(extractor.descriptor_width));
  }
  return {std::move(extractor.part), std::move(matcher.part)};
}

}  // namespace demslam

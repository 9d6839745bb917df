#include "demslam/features/frontend.h"

#include "demslam/base/error.h"
#include "demslam/features/classical_extractor.h"
#include "demslam/features/frontend_names.h"
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
  std::string backend = {};  ///< of its network
};

template <class Part>
using Makers = std::vector<std::pair<std::string, Sized<Part> (*)(const FrontendOptions&)>>;

Sized<Extractor> learned_extractor(OpenModel model, const FrontendOptions& o) {
  const int width = model.info.descriptor_width;
  const std::string backend = model.info.backend;
  return {make_learned_extractor(std::move(model), o.max_features), width, backend};
}

Sized<Matcher> learned_matcher(OpenModel model, const FrontendOptions& o) {
  const int width = model.info.descriptor_width;
  const std::string backend = model.info.backend;
  return {make_learned_matcher(std::move(model), o.min_match_score), width, backend};
}

using O = FrontendOptions;

InferenceOptions inference_of(const O& o) { return {o.inference, o.threads}; }

const Makers<Extractor>& extractors() {
  static const Makers<Extractor> all{
      {"classical",
       [](const O& o) {
         return Sized<Extractor>{std::make_unique<ClassicalExtractor>(o.max_features),
                                 ClassicalExtractor::kDescriptorWidth};
       }},
      {"lunar", [](const O& o) { return learned_extractor(open_built_in_model("lunar", inference_of(o)), o); }},
      {"onnx", [](const O& o) { return learned_extractor(open_model(o.extractor_model, inference_of(o)), o); }},
      {"orb", [](const O& o) { return Sized<Extractor>{make_orb_extractor(o.max_features)}; }},
      {"sift", [](const O& o) { return Sized<Extractor>{make_sift_extractor(o.max_features)}; }},
  };
  return all;
}

const Makers<Matcher>& matchers() {
  static const Makers<Matcher> all{
      {"nearest", [](const O& o) { return Sized<Matcher>{std::make_unique<NearestMatcher>(o.nearest_ratio)}; }},
      {"lunar", [](const O& o) { return learned_matcher(open_built_in_model("lunar-matcher", inference_of(o)), o); }},
      {"onnx", [](const O& o) { return learned_matcher(open_model(o.matcher_model, inference_of(o)), o); }},
  };
  return all;
}

template <class Part>
std::vector<std::string> names_of(const Makers<Part>& makers) {
  std::vector<std::string> names;
  for (const auto& [name, make] : makers) names.push_back(name);
  return names;
}

template <class Part>
Sized<Part> make_part(const char* what, const Makers<Part>& makers, const std::string& wanted, const O& options) {
  std::string known;
  for (const auto& [name, make] : makers) {
    if (name == wanted) return make(options);
    known += (known.empty() ? "" : ", ") + name;
  }
  throw Error(std::string("unknown ") + what + " '" + wanted + "'; known: " + known);
}

}  // namespace

std::vector<std::string> extractor_names() { return names_of(extractors()); }
std::vector<std::string> matcher_names() { return names_of(matchers()); }

Frontend make_frontend(const FrontendOptions& options) {
  resolved_inference(options.inference);  // a wrong name is told even where no network is to be run
  Sized<Extractor> extractor = make_part("extractor", extractors(), options.extractor, options);
  Sized<Matcher> matcher = make_part("matcher", matchers(), options.matcher, options);
  const bool known = extractor.descriptor_width != kAnyWidth && matcher.descriptor_width != kAnyWidth;
  if (known && extractor.descriptor_width != matcher.descriptor_width) {
    const std::string name = options.matcher == "onnx" ? options.matcher_model.string() : options.matcher;
    throw Error(name + ": matches descriptors of width " + std::to_string(matcher.descriptor_width) +
                ", but the extractor gives width " + std::to_string(extractor.descriptor_width));
  }
  const bool same = extractor.backend == matcher.backend || matcher.backend.empty();
  const std::string between = extractor.backend.empty() || same ? "" : ", ";
  return {std::move(extractor.part), std::move(matcher.part),
          extractor.backend + between + (same ? "" : matcher.backend)};
}

FrontendOptions resolved(FrontendOptions options) {
  const auto is_network = [](const std::string& name) { return name == "lunar" || name == "onnx"; };
  if (is_network(options.extractor) || is_network(options.matcher)) {
    options.inference = resolved_inference(options.inference);
  }
  return options;
}

}  // namespace demslam

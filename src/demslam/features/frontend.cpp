#include "demslam/features/frontend.h"

#include "demslam/base/error.h"
#include "demslam/features/classical_extractor.h"
#include "demslam/features/learned.h"
#include "demslam/features/nearest_matcher.h"

namespace demslam {
namespace {

constexpr int kAnyWidth = -1;

/// A part and the width of the descriptors it gives or takes.
template <class Part>
struct Sized {
  std::unique_ptr<Part> part;
  int descriptor_width = kAnyWidth;
};

Sized<Extractor> make_extractor(const FrontendOptions& options) {
  if (options.extractor == "classical") {
    return {std::make_unique<ClassicalExtractor>(options.max_features), ClassicalExtractor::kDescriptorWidth};
  }
  if (options.extractor != "onnx") throw Error("unknown extractor '" + options.extractor + "'; known: classical, onnx");
  OpenModel model = open_model(options.extractor_model, options.threads);
  const int width = model.info.descriptor_width;
  return {make_learned_extractor(std::move(model), options.max_features), width};
}

Sized<Matcher> make_matcher(const FrontendOptions& options) {
  if (options.matcher == "nearest") return {std::make_unique<NearestMatcher>(options.nearest_ratio)};
  if (options.matcher != "onnx") throw Error("unknown matcher '" + options.matcher + "'; known: nearest, onnx");
  OpenModel model = open_model(options.matcher_model, options.threads);
  const int width = model.info.descriptor_width;
  return {make_learned_matcher(std::move(model), options.min_match_score), width};
}

}  // namespace

Frontend make_frontend(const FrontendOptions& options) {
  Sized<Extractor> extractor = make_extractor(options);
  Sized<Matcher> matcher = make_matcher(options);
  const bool known = extractor.descriptor_width != kAnyWidth && matcher.descriptor_width != kAnyWidth;
  if (known && extractor.descriptor_width != matcher.descriptor_width) {
    throw Error(options.matcher_model.string() + ": matches descriptors of width " +
                std::to_string(matcher.descriptor_width) + ", but the extractor gives width " +
                std::to_string(extractor.descriptor_width));
  }
  return {std::move(extractor.part), std::move(matcher.part)};
}

}  // namespace demslam

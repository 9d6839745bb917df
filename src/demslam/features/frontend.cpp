#include "demslam/features/frontend.h"

#include "demslam/base/error.h"
#include "demslam/features/classical_extractor.h"
#include "demslam/features/nearest_matcher.h"

namespace demslam {
namespace {

std::unique_ptr<Extractor> make_extractor(const FrontendOptions& options) {
  if (options.extractor == "classical") return std::make_unique<ClassicalExtractor>(options.max_features);
  throw Error("unknown extractor '" + options.extractor + "'; known: classical");
}

std::unique_ptr<Matcher> make_matcher(const FrontendOptions& options) {
  if (options.matcher == "nearest") return std::make_unique<NearestMatcher>(options.nearest_ratio);
  throw Error("unknown matcher '" + options.matcher + "'; known: nearest");
}

}  // namespace

Frontend make_frontend(const FrontendOptions& options) { return {make_extractor(options), make_matcher(options)}; }

}  // namespace demslam

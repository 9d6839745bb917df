#include "demslam/features/nearest_matcher.h"

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/features/similarity.h"

namespace demslam {
namespace {

Rows rows_of(const Features& features) {
  return {features.descriptors.data(), features.size(), static_cast<std::size_t>(features.descriptors.cols())};
}

double distance_of_unit_vectors(float cosine) {
  return std::sqrt(std::max(0.0, 2.0 - 2.0 * static_cast<double>(cosine)));
}

}  // namespace

std::vector<Match> NearestMatcher::match(const Features& query, const Features& train) {
  if (query.size() == 0 || train.size() == 0) return {};
  if (query.descriptors.cols() != train.descriptors.cols()) {
    throw Error("cannot match descriptors of width " + std::to_string(query.descriptors.cols()) + " with width " +
                std::to_string(train.descriptors.cols()) + "; use one extractor for both images");
  }
  const MutualBest best = best_products(rows_of(query), rows_of(train));
  std::vector<Match> matches;
  for (std::size_t q = 0; q < query.size(); ++q) {
    const BestTwo& candidate = best.of_query[q];
    if (candidate.index < 0) continue;  // a descriptor that is no number resembles nothing
    const double distance = distance_of_unit_vectors(candidate.best);
    const bool distinct = train.size() == 1 || distance < ratio_ * distance_of_unit_vectors(candidate.second);
    if (!distinct || best.of_train[candidate.index] != static_cast<int>(q)) continue;
    matches.push_back({static_cast<int>(q), candidate.index, static_cast<float>(1.0 - distance / 2.0)});
  }
  return matches;
}

}  // namespace demslam

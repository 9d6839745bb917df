#include "demslam/graph/appearance.h"

#include <algorithm>
#include <utility>

namespace demslam {

void PlaceIndex::add(const GlobalDescriptor& descriptor) { places_.push_back(descriptor); }

std::vector<std::size_t> PlaceIndex::nearest(const GlobalDescriptor& descriptor, std::size_t end,
                                             std::size_t count) const {
  std::vector<std::pair<double, std::size_t>> ranked;  // unlikeness, place
  ranked.reserve(std::min(end, places_.size()));
  for (std::size_t i = 0; i < std::min(end, places_.size()); ++i) {
    ranked.emplace_back(-similarity(descriptor, places_[i]), i);
  }
  count = std::min(count, ranked.size());
  std::ranges::partial_sort(ranked, ranked.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < count; ++i) best.push_back(ranked[i].second);
  return best;
}

/// A few keyframes are caught up with at once; many, after an interruption, only when they are asked for.
void Appearance::see(std::size_t keyframe) {
  if (keyframe < index_.size() + kLearnFrom) index_until(keyframe + 1);
}

std::vector<std::size_t> Appearance::like(std::size_t keyframe, std::size_t end, std::size_t count) {
  index_until(keyframe + 1);
  if (index_.size() <= keyframe) return {};
  return index_.nearest(index_.at(keyframe), std::min(end, keyframe), count);
}

void Appearance::learn() {
  std::vector<std::shared_ptr<const StereoFeatures>> views;
  Eigen::Index rows = 0;
  for (std::size_t k = 0; k < kLearnFrom; ++k) {
    views.push_back(features_(k));
    rows += views.back()->left.descriptors.rows();
  }
  DescriptorRows examples(rows, views.front()->left.descriptors.cols());
  Eigen::Index row = 0;
  for (const auto& view : views) {
    examples.middleRows(row, view->left.descriptors.rows()) = view->left.descriptors;
    row += view->left.descriptors.rows();
  }
  describer_.emplace(examples);
}

void Appearance::index_until(std::size_t end) {
  if (end < kLearnFrom) return;
  if (!describer_) learn();
  while (index_.size() < end) index_.add(describer_->describe(features_(index_.size())->left.descriptors));
}

}  // namespace demslam

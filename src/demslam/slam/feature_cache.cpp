#include "demslam/slam/feature_cache.h"

#include <algorithm>

namespace demslam {

void FeatureCache::add(std::size_t keyframe, std::shared_ptr<const StereoFeatures> features) {
  entries_[keyframe] = {std::move(features), ++uses_};
  if (!stored_ || entries_.size() <= kCapacity) return;
  entries_.erase(std::ranges::min_element(entries_, {}, [](const auto& entry) { return entry.second.last_use; }));
}

std::shared_ptr<const StereoFeatures> FeatureCache::at(std::size_t keyframe) {
  const auto found = entries_.find(keyframe);
  if (found == entries_.end()) {
    if (!stored_) return nullptr;
    auto features = stored_(keyframe);
    add(keyframe, features);
    return features;
  }
  found->second.last_use = ++uses_;
  return found->second.features;
}

std::shared_ptr<const StereoFeatures> FeatureCache::glance_at(std::size_t keyframe) const {
  const auto found = entries_.find(keyframe);
  if (found != entries_.end()) return found->second.features;
  return stored_ ? stored_(keyframe) : nullptr;
}

}  // namespace demslam

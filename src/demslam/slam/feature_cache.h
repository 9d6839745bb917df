#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "demslam/graph/loop_closure.h"

namespace demslam {

/// Features of keyframes for loop closure: the last used in memory, the others read again from where they are stored.
class FeatureCache {
 public:
  static constexpr std::size_t kCapacity = 24;

  /// Without a store everything stays in memory.
  explicit FeatureCache(FeatureSource stored) : stored_(std::move(stored)) {}

  void add(std::size_t keyframe, std::shared_ptr<const StereoFeatures> features);
  std::shared_ptr<const StereoFeatures> at(std::size_t keyframe);
  /// The same, for passing over many: what is read takes no other's place.
  std::shared_ptr<const StereoFeatures> glance_at(std::size_t keyframe) const;

 private:
  struct Entry {
    std::shared_ptr<const StereoFeatures> features;
    std::uint64_t last_use = 0;
  };
  FeatureSource stored_;
  std::map<std::size_t, Entry> entries_;
  std::uint64_t uses_ = 0;
};

}  // namespace demslam

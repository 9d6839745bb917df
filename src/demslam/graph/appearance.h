#pragma once

#include <optional>
#include <vector>

#include "demslam/features/global_descriptor.h"
#include "demslam/graph/loop_closure.h"

namespace demslam {

/// Global descriptors of places in the order they were visited, 128 bytes each. A view is compared with all of them:
/// 26 MB for 200,000 places, no tree to build or to keep.
class PlaceIndex {
 public:
  std::size_t size() const { return places_.size(); }
  /// Of place number size().
  void add(const GlobalDescriptor& descriptor);
  const GlobalDescriptor& at(std::size_t place) const { return places_[place]; }
  /// Most similar first, at most `count`, of the places before number `end`; of equal ones the older first.
  std::vector<std::size_t> nearest(const GlobalDescriptor& descriptor, std::size_t end, std::size_t count) const;

 private:
  std::vector<GlobalDescriptor> places_;
};

/// Old keyframes that look like a new one, by the front-end's own features. The words (global_descriptor.h) are learned
/// from the run's first keyframes. What it answers depends on the features alone, not on when it was asked: a run that
/// goes on after an interruption gets the same answers.
class Appearance {
 public:
  static constexpr std::size_t kLearnFrom = 10;  ///< keyframes; before that many there are no answers

  /// `features` must have those of every keyframe.
  explicit Appearance(FeatureSource features) : features_(std::move(features)) {}

  /// The features of a new keyframe are at hand. Without this call, they are read when first needed.
  void see(std::size_t keyframe);
  /// At most `count` keyframes before number `end` that look like `keyframe`, best first.
  std::vector<std::size_t> like(std::size_t keyframe, std::size_t end, std::size_t count);

 private:
  void learn();
  void index_until(std::size_t end);

  FeatureSource features_;
  std::optional<GlobalDescriber> describer_;
  PlaceIndex index_;
};

}  // namespace demslam

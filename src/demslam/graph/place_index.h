#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "demslam/features/vocabulary.h"

namespace demslam {

struct PlaceOptions {
  int words = 8;
  std::size_t training_keyframes = 20;  ///< the vocabulary is trained on the first ones of the run
  double spacing_m = 2.0;               ///< path between two keyframes that are remembered
  double min_path_m = 30.0;             ///< and between a place and its remembrance
  std::size_t candidates = 3;
  double min_similarity = 0.2;  ///< scalar product of two descriptions
  std::uint64_t seed = 1;
};

/// What the places of a run look like: one compact description each (512 bytes for 8 words of width 64). Asked where a
/// rover may be whose position says too little; the cost of a question grows with the places remembered (10 ms for
/// 50,000).
class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceOptions& options = {}) : options_(options) {}

  /// Keyframes in order, each with the path driven.
  void add(std::size_t keyframe, double path_m, const DescriptorRows& descriptors);
  /// Keyframes that look like the one added last, best first.
  std::vector<std::size_t> like_the_newest() const;
  std::size_t places() const { return places_.size(); }

 private:
  struct Place {
    std::size_t keyframe = 0;
    double path_m = 0.0;
    std::vector<std::int8_t> description;
  };
  void train();

  PlaceOptions options_;
  std::optional<Vocabulary> vocabulary_;
  std::vector<Place> places_;
  std::vector<std::pair<Place, DescriptorRows>> untrained_;  ///< until there is a vocabulary
  Place newest_;
};

}  // namespace demslam

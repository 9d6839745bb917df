#include "demslam/graph/place_index.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace demslam {
namespace {

constexpr float kOne = 127.0F;  // a component of one

std::vector<std::int8_t> compact(const Eigen::VectorXf& description) {
  std::vector<std::int8_t> bytes;
  for (const float value : description) bytes.push_back(static_cast<std::int8_t>(std::lround(kOne * value)));
  return bytes;
}

/// Cosine of the angle between two compact descriptions.
double similarity(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b) {
  int dot = 0, aa = 0, bb = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    dot += a[n] * b[n];
    aa += a[n] * a[n];
    bb += b[n] * b[n];
  }
  return aa > 0 && bb > 0 ? dot / std::sqrt(static_cast<double>(aa) * bb) : 0.0;
}

}  // namespace

void PlaceIndex::train() {
  std::vector<const DescriptorRows*> images;
  for (const auto& [place, descriptors] : untrained_) images.push_back(&descriptors);
  vocabulary_ = Vocabulary::train(images, options_.words, options_.seed);
  for (auto& [place, descriptors] : untrained_) {
    place.description = compact(vocabulary_->describe(descriptors));
    places_.push_back(std::move(place));
  }
  untrained_.clear();
}

void PlaceIndex::add(std::size_t keyframe, double path_m, const DescriptorRows& descriptors) {
  newest_ = {keyframe, path_m, {}};
  if (!vocabulary_) {
    untrained_.emplace_back(newest_, descriptors);
    if (untrained_.size() >= options_.training_keyframes) train();
    return;
  }
  newest_.description = compact(vocabulary_->describe(descriptors));
  if (places_.empty() || path_m - places_.back().path_m >= options_.spacing_m) places_.push_back(newest_);
}

std::vector<std::size_t> PlaceIndex::like_the_newest() const {
  std::vector<std::pair<double, std::size_t>> alike;  // minus similarity, keyframe
  for (const Place& place : places_) {
    if (newest_.path_m - place.path_m < options_.min_path_m || newest_.description.empty()) break;
    const double score = similarity(place.description, newest_.description);
    if (score >= options_.min_similarity) alike.emplace_back(-score, place.keyframe);
  }
  std::sort(alike.begin(), alike.end());
  std::vector<std::size_t> keyframes;
  for (std::size_t n = 0; n < std::min(alike.size(), options_.candidates); ++n) keyframes.push_back(alike[n].second);
  return keyframes;
}

}  // namespace demslam

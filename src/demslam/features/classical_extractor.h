#pragma once

#include "demslam/features/features.h"

namespace demslam {

/// Corners (Shi-Tomasi response, sub-pixel peak, spread over a grid of cells) with upright SIFT descriptors of one
/// scale. Needs no file. Upright and single-scale on purpose: a rover rolls little, and neighbouring views differ
/// little in scale. Gives no corner where the image is flat: a black image has no features.
class ClassicalExtractor : public Extractor {
 public:
  explicit ClassicalExtractor(int max_features) : max_features_(max_features) {}
  Features extract(const Image& image) override;

 private:
  int max_features_;
};

}  // namespace demslam

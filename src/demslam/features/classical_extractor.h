#pragma once

#include "demslam/features/features.h"

namespace demslam {

/// Corners (Foerstner's measure, sub-pixel peak, spread over a grid of cells), described by 4x4 upright sums of eight
/// gradient directions, as SIFT does, read from maps that are filtered once per image (after DAISY). Needs no file.
/// Upright and of one scale on purpose: a rover rolls little, and neighbouring views differ little in scale. Flat
/// image, no corner.
class ClassicalExtractor : public Extractor {
 public:
  static constexpr int kDescriptorWidth = 128;

  explicit ClassicalExtractor(int max_features) : max_features_(max_features) {}
  Features extract(const Image& image) override;

 private:
  int max_features_;
};

}  // namespace demslam

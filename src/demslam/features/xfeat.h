#pragma once

#include "demslam/features/features.h"

namespace demslam {

/// What the XFeat network gives for an image of (8 columns) x (8 rows) pixels; maps of rows x columns, channel-major
/// unless `_by_cell`, that is, with the channels of a cell side by side.
struct XFeatMaps {
  const std::vector<float>& descriptors;  ///< width channels, not normalised
  int width = 0, rows = 0, columns = 0;
  const std::vector<float>& keypoint_logits;  ///< 65 channels: the 8x8 pixels of a cell in reading order, then "none"
  const std::vector<float>& reliability;      ///< 1 channel
  bool descriptors_by_cell = false, logits_by_cell = false;
};

inline constexpr float kXFeatMinProbability = 0.05F;  ///< XFeat's own

/// XFeat's own decoding (CVPR 2024), with keypoints moved to the sub-pixel peak of the log-probability, which the
/// original leaves at whole pixels; descriptors are still read at the whole pixel. Best first, at most `max_features`,
/// inside the image only, those of a probability above `min_probability`.
Features decode_xfeat(const XFeatMaps& maps, int image_width, int image_height, int max_features,
                      float min_probability = kXFeatMinProbability);

/// Indices of the largest `count` scores, largest first; equal ones in ascending order.
std::vector<std::size_t> strongest(const std::vector<float>& scores, int count);

}  // namespace demslam

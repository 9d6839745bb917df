#pragma once

#include <cstddef>
#include <vector>

#include "demslam/image/image.h"

namespace demslam {

/// Row differences v_right - v_left of patches found in both images of a rectified pair, pixels, to a fraction of one.
/// Block matching by normalised correlation over disparities 0 .. a quarter of the width and rows +-8; patches without
/// texture or with a second good place are left out. Means nothing on images that are not rectified.
std::vector<double> row_differences_px(const Image& left, const Image& right);

/// The middle of row differences and their spread (1.4826 * median absolute deviation: sigma of normal errors).
struct RowOffset {
  std::size_t patches = 0;
  double offset_px = 0.0, spread_px = 0.0;
};
RowOffset row_offset(std::vector<double> differences_px);

}  // namespace demslam

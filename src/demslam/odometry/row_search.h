#pragma once

#include <vector>

#include "demslam/image/image.h"

namespace demslam {

/// Horizontal gradient, clipped and centred on 128: what the two cameras agree on even if their exposures differ.
Image gradient_image(const Image& image);

/// Searches a row of a gradient image for the patch around a pixel of the other one, by the sum of absolute
/// differences.
class RowSearch {
 public:
  struct Result {
    int shift_px = 0;
    double uniqueness = 1.0;  ///< cost of the best over cost of the best elsewhere: small is unique
    bool found = false;
  };

  RowSearch(const Image& reference_gradient, const Image& other_gradient)
      : reference_(reference_gradient), other_(other_gradient) {}

  /// Shifts s in [first, last]: reference (u, v) against other (u + s, v).
  Result search(int u, int v, int first_shift, int last_shift, std::vector<int>& costs) const;

 private:
  const Image& reference_;
  const Image& other_;
};

}  // namespace demslam

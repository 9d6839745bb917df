#pragma once

#include <vector>

namespace demslam {

/// Where the rays of one pass go through their pixels, and what the pass is for.
struct Pass {
  double du = 0.0, dv = 0.0;  ///< from the pixel's centre
  double time = 0.0;          ///< from mid-exposure, in exposure times
  float weight = 1.0F;        ///< of this pass in the pixel's mean radiance; 0: geometry only
  bool is_centre = true;      ///< defines depth, surface and normal
};

/// The further rays of a pixel whose mean one ray does not give: a square turned by atan(1/2), which has four rows and
/// four columns.
inline constexpr int kFurtherRays = 4;
std::vector<Pass> further_passes();

/// n x n rays per pixel, spread over the exposure in another order than over the pixel; the centre at mid-exposure.
std::vector<Pass> passes_of(int per_axis);

/// The same rays at several moments of the exposure, where there is one ray per pixel only.
std::vector<Pass> moments_of(int count);

}  // namespace demslam

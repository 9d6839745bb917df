#pragma once

#include <cstdint>
#include <vector>

#include "demslam/image/image.h"
#include "demslam/sim/renderer.h"

namespace demslam {

/// Exposure that puts the 98th percentile of the lit pixels at 80 % of white; 1 when nothing is lit.
double automatic_exposure(const Rendering& rendering);

/// The grey values of an image of 8, 10 or 12 bits.
struct Levels {
  int width = 0, height = 0, bits = 8;
  std::vector<std::uint16_t> values;  ///< 0 to 2^bits - 1

  Image upper_byte() const;                    ///< the 8 highest bits: what a reader of 8-bit images sees
  std::vector<std::uint16_t> aligned() const;  ///< the bits at the upper end of 16
};

/// Optics and electronics: dust on the window, blur, exposure, photon and read noise, gamma, quantisation. The noise
/// depends on `noise_key` and the pixel alone, the dust on `window_key`, so any frame can be made again by itself.
Levels develop(const Rendering& rendering, const CameraOptions& camera, double exposure, std::uint64_t noise_key,
               std::uint64_t window_key = 0);

}  // namespace demslam

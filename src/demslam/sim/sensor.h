#pragma once

#include <cstdint>

#include "demslam/image/image.h"
#include "demslam/sim/renderer.h"

namespace demslam {

/// Exposure that puts the 98th percentile of the lit pixels at 80 % of white; 1 when nothing is lit.
double automatic_exposure(const Rendering& rendering);

/// Optics and electronics: blur, exposure, photon and read noise, gamma, 8 bits. The noise depends on `noise_key` and
/// the pixel alone, so any frame can be made again by itself.
Image develop(const Rendering& rendering, const CameraOptions& camera, double exposure, std::uint64_t noise_key);

}  // namespace demslam

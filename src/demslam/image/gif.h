#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "demslam/image/image.h"

namespace demslam {

/// The bytes of an animated GIF (89a, 256 greys, LZW) that repeats for ever; every frame is shown for `frame_s` seconds
/// (hundredths are kept). All frames have the size of the first. Throws Error when there are none.
std::vector<std::uint8_t> gif_bytes(std::span<const Image> frames, double frame_s);

}  // namespace demslam

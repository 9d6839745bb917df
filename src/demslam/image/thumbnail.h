#pragma once

#include <string>

#include "demslam/image/image.h"

namespace demslam {

/// The bytes of a JPEG of the whole image, at most `max_width` pixels wide (areas averaged), quality 0 to 100.
std::string jpeg_thumbnail(const Image& image, int max_width, int quality);

}  // namespace demslam

#pragma once

#include <array>
#include <cstddef>

#include "demslam/image/canvas.h"

namespace demslam {

/// Okabe-Ito, told apart by colour-blind readers too; the page has the same in the same order.
inline Colour run_colour(std::size_t run) {
  constexpr std::array<Colour, 5> kColours{
      {{213, 94, 0}, {0, 114, 178}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}}};
  return kColours[run % kColours.size()];
}

}  // namespace demslam

#pragma once

#include <string>

#include "demslam/image/image.h"

namespace demslam {

/// Tells frames that cannot be tracked before any work is spent on them. Remembers the previous pair.
class FrameCheck {
 public:
  FrameCheck(int width, int height) : width_(width), height_(height) {}

  /// "empty frame", "wrong size", "dark frame", "saturated frame", "frozen frame", or nothing if the pair is usable.
  std::string problem(const Image& left, const Image& right);
  /// The previous usable pair, after a restart.
  void remember(const Image& left, const Image& right);

 private:
  int width_, height_;
  Image last_left_, last_right_;
};

}  // namespace demslam

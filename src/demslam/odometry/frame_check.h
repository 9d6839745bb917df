#pragma once

#include <memory>
#include <string>

#include "demslam/image/image.h"

namespace demslam {

/// Tells pairs that show nothing before any work is spent on them: "empty frame", "frame of another size", "dark
/// frame", "saturated frame", or nothing if the pair is usable.
std::string problem_of(const Image& left, const Image& right, int width, int height);

/// Tells a camera that repeats itself.
class FrozenCheck {
 public:
  /// Whether either image is the one of the usable pair before; if not, this pair is remembered.
  bool is_frozen(const std::shared_ptr<const Image>& left, const std::shared_ptr<const Image>& right);
  /// The previous usable pair, after a restart.
  void remember(std::shared_ptr<const Image> left, std::shared_ptr<const Image> right);

 private:
  std::shared_ptr<const Image> last_left_, last_right_;
};

}  // namespace demslam

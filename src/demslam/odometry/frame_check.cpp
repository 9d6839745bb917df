#include "demslam/odometry/frame_check.h"

#include <array>
#include <utility>

namespace demslam {
namespace {

constexpr int kDarkGrey = 12;  // a frame whose brightest half percent is darker shows nothing
constexpr double kDarkPart = 0.995;
constexpr int kSaturatedGrey = 250;  // a frame whose pixels are nearly all brighter shows nothing either
constexpr double kSaturatedPart = 0.05;

/// The grey value that a part of the pixels stays at or below.
int grey_quantile(const Image& image, double part) {
  std::array<std::size_t, 256> histogram{};
  for (const std::uint8_t grey : image.pixels) ++histogram[grey];
  const double wanted = part * static_cast<double>(image.pixels.size());
  double count = 0.0;
  for (int grey = 0; grey < 256; ++grey) {
    count += static_cast<double>(histogram[grey]);
    if (count >= wanted) return grey;
  }
  return 255;
}

std::string problem_of(const Image& image, int width, int height) {
  if (image.empty()) return "empty frame";
  if (image.width != width || image.height != height) return "frame of another size";
  if (grey_quantile(image, kDarkPart) < kDarkGrey) return "dark frame";
  if (grey_quantile(image, kSaturatedPart) > kSaturatedGrey) return "saturated frame";
  return {};
}

}  // namespace

std::string problem_of(const Image& left, const Image& right, int width, int height) {
  const std::string problem = problem_of(left, width, height);
  return problem.empty() ? problem_of(right, width, height) : problem;
}

bool FrozenCheck::is_frozen(const std::shared_ptr<const Image>& left, const std::shared_ptr<const Image>& right) {
  if (last_left_ && (left->pixels == last_left_->pixels || right->pixels == last_right_->pixels)) return true;
  remember(left, right);
  return false;
}

void FrozenCheck::remember(std::shared_ptr<const Image> left, std::shared_ptr<const Image> right) {
  last_left_ = std::move(left);
  last_right_ = std::move(right);
}

}  // namespace demslam

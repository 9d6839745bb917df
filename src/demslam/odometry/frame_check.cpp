#include "demslam/odometry/frame_check.h"

#include <array>

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

std::string FrameCheck::problem(const Image& left, const Image& right) {
  for (const Image* image : {&left, &right}) {
    std::string problem = problem_of(*image, width_, height_);
    if (!problem.empty()) return problem;
  }
  if (left.pixels == last_left_.pixels || right.pixels == last_right_.pixels) return "frozen frame";
  remember(left, right);
  return {};
}

void FrameCheck::remember(const Image& left, const Image& right) {
  last_left_ = left;
  last_right_ = right;
}

}  // namespace demslam

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include <Eigen/Core>

#include "demslam/image/image.h"

namespace demslam {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// A colour picture to draw on: coordinates (u, v) in pixels, the centre of the top-left pixel is (0, 0), sub-pixel and
/// anti-aliased. What falls outside is cut off.
class Canvas {
 public:
  Canvas(int width, int height, Colour background = {255, 255, 255});
  ~Canvas();
  Canvas(Canvas&&) noexcept;

  int width() const;
  int height() const;
  Colour at(int u, int v) const;

  void fill(Colour colour);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Colour colour, int thickness_px = 1);
  void polyline(std::span<const Eigen::Vector2d> points, Colour colour, int thickness_px = 1);
  /// Filled where the thickness is negative.
  void circle(const Eigen::Vector2d& centre, double radius_px, Colour colour, int thickness_px = 1);
  /// `position` is the left end of the baseline. A scale of 1 is about 22 px high.
  void text(const std::string& text, const Eigen::Vector2d& position, Colour colour, double scale = 1.0,
            int thickness_px = 1);
  /// Width and height of a text as drawn, pixels.
  static Eigen::Vector2d text_size(const std::string& text, double scale = 1.0, int thickness_px = 1);

  /// Draws a grey image with its top-left pixel at (u, v), each pixel `zoom` pixels wide.
  void draw(const Image& image, int u = 0, int v = 0, double zoom = 1.0);
  /// Draws a raster, row-major from the top-left, in grey from `low` (black) to `high` (white); NaN stays as it is.
  void draw(std::span<const float> values, int columns, float low, float high, int u = 0, int v = 0, double zoom = 1.0);

  /// The bytes of a PNG file.
  std::string png() const;
  /// PNG or JPEG by extension. Throws Error when it cannot be written.
  void write(const std::filesystem::path& file) const;

 private:
  struct Picture;
  std::unique_ptr<Picture> picture_;
};

}  // namespace demslam

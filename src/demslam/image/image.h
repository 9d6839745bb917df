#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace demslam {

/// 8-bit grey image, row-major without padding. The centre of the top-left pixel is (0, 0).
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  Image() = default;
  Image(int width_px, int height_px, std::uint8_t value = 0)
      : width(width_px), height(height_px), pixels(static_cast<std::size_t>(width_px) * height_px, value) {}

  bool empty() const { return pixels.empty(); }
  std::uint8_t& at(int u, int v) { return pixels[static_cast<std::size_t>(v) * width + u]; }
  std::uint8_t at(int u, int v) const { return pixels[static_cast<std::size_t>(v) * width + u]; }
};

/// Reads any image file OpenCV knows as 8-bit grey (colour by Rec. 601 luma; 16-bit by its upper byte).
/// Throws Error naming the file when it is missing, truncated or no image.
Image read_image(const std::filesystem::path& file);

/// Writes PNG or JPEG by extension. Throws Error when the disk is full or the folder is not writable.
void write_image(const std::filesystem::path& file, const Image& image);
/// Writes a 16-bit grey PNG, `values` row by row.
void write_image(const std::filesystem::path& file, int width, int height, const std::vector<std::uint16_t>& values);

}  // namespace demslam
